// SPDX-License-Identifier: BSD-3-Clause
// Removes rolling shutter and stamp lag from a depth image: the result is what the camera at the stamp would have seen.
// Not needed for depth sensors with a global shutter and the stamps of the colour image.
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_frontend/tracking/row_camera.h"

namespace vip_slam {

class DepthRows {
 public:
  explicit DepthRows(std::shared_ptr<const CameraModel> camera);

  /// `depth`: 32FC1, metres along z, 0 or NaN invalid. Every pixel of the result is looked up where its surface was
  /// when its row was read: interpolated in inverse depth among four neighbours on one surface, else the nearest
  /// reading.
  cv::Mat atStamp(const cv::Mat& depth, const RowPoses& rows) const;

 private:
  std::shared_ptr<const CameraModel> camera_;
  /// Per pixel: its ray (x, y, 1), and pixels per unit of x and y.
  struct Rays {
    std::vector<float> x, y, ux, uy, vx, vy;
  } rays_;
};

}  // namespace vip_slam
