// SPDX-License-Identifier: BSD-3-Clause
#include "depth_alignment.h"

#include <exception>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

DepthAlignment::DepthAlignment(const SensorConfig& sensor)
    : color_topic_(sensor.topics.color), depth_topic_(sensor.topics.depth), to_colour_(sensor) {}

cv::Mat DepthAlignment::align(const cv::Mat& depth, const cv::Size& color, std::string* problem) const {
  problem->clear();
  if (depth.empty()) return depth;
  cv::Mat aligned;
  try {
    aligned = to_colour_(depth);
  } catch (const std::exception& error) {
    *problem = depth_topic_ + ": " + error.what() + ": depth is not used";
    return {};
  }
  if (aligned.size() != color) {
    *problem =
        formatted("%s is %dx%d, %s is %dx%d: depth is not used; switch on the driver's registration",
                  depth_topic_.c_str(), aligned.cols, aligned.rows, color_topic_.c_str(), color.width, color.height);
  }
  return aligned;
}

}  // namespace vip_slam
