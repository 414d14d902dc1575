// Registers depth to the colour camera, as the estimator needs it. Mismatches are reported instead of thrown, so that a
// wrongly configured camera costs the depth and not the odometry.
#pragma once

#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

class DepthAlignment {
 public:
  /// Throws std::invalid_argument when depth is to be registered and a camera is unusable.
  explicit DepthAlignment(const SensorConfig& sensor);

  /// `depth`: metres, may be empty. Without registration it is returned unchanged, also when it does not fit; else
  /// registered, or empty. `problem`: what does not fit, in words; empty when all fits.
  cv::Mat align(const cv::Mat& depth, const cv::Size& color, std::string* problem) const;

 private:
  std::string color_topic_, depth_topic_;
  std::optional<DepthRegistration> registration_;  ///< empty: the driver registers
};

}  // namespace vip_slam
