// SPDX-License-Identifier: BSD-3-Clause
// Registers depth to the colour camera, as the estimator needs it. Mismatches are reported instead of thrown, so that a
// wrongly configured camera costs the depth and not the odometry.
#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam {

class DepthAlignment {
 public:
  /// Throws std::invalid_argument when depth is to be registered or distorted and a camera is unusable.
  explicit DepthAlignment(const SensorConfig& sensor);

  /// `depth`: metres, may be empty. Depth that is as the colour image already is returned unchanged, also when it does
  /// not fit; else aligned, or empty. `problem`: what does not fit, in words; empty when all fits.
  cv::Mat align(const cv::Mat& depth, const cv::Size& color, std::string* problem) const;

 private:
  std::string color_topic_, depth_topic_;
  DepthToColour to_colour_;
};

}  // namespace vip_slam
