// Depth as the estimator takes it: in the colour camera. What does not fit is named instead of thrown, so that a camera
// set up wrongly costs the depth and not the odometry.
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

  /// `depth`: metres, may be empty. Without registration it comes back as it is, also when it does not fit; else
  /// registered, or empty. `problem`: what does not fit, in words; empty when all does.
  cv::Mat align(const cv::Mat& depth, const cv::Size& color, std::string* problem) const;

 private:
  std::string color_topic_, depth_topic_;
  std::optional<DepthRegistration> registration_;  ///< empty: the driver registers
};

}  // namespace vip_slam
