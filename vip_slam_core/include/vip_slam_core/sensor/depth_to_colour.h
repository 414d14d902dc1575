// SPDX-License-Identifier: BSD-3-Clause
// Depth images as a driver publishes them, brought to the pixels of the colour image, as the sensor file says: the one
// place for the live system, run_bag and check_bag.
#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

class DepthToColour {
 public:
  /// Needs the cameras of `sensor` resolved (from camera_info, where that is their source). Throws
  /// std::invalid_argument when one that is needed is unusable.
  explicit DepthToColour(const SensorConfig& sensor);

  /// Depth pixels are those of the colour image already: operator() returns its argument.
  bool asPublished() const { return !registration_ && source_.empty(); }
  /// `depth`: 32FC1, metres, as published. Returns 32FC1 metres of the colour image's size, 0 = invalid. Throws
  /// std::invalid_argument naming both sizes when `depth` is not what the sensor file describes; depth that is not
  /// changed has any size.
  cv::Mat operator()(const cv::Mat& depth) const;

 private:
  std::optional<DepthRegistration> registration_;  ///< depth/registered is false
  cv::Mat source_;  ///< depth/undistorted is true: 32SC1, index of each colour pixel's depth pixel, row-major; -1
                    ///< without one
};

/// The camera without its lens: the same focal lengths and principal point, no distortion.
CameraIntrinsics pinholeOf(const CameraIntrinsics& camera);

/// Largest distance in pixels between a pixel of the image and where the camera without its lens would see the same;
/// along the border, where it is largest. 0 without distortion.
double largestDistortion(const CameraIntrinsics& camera);

}  // namespace vip_slam
