// SPDX-License-Identifier: BSD-3-Clause
// Images and intrinsics to messages, as converters and the stereo nodelet need them.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// Copies `image` (continuous or not) into a message of the given encoding.
sensor_msgs::Image imageMessage(const cv::Mat& image, const std::string& encoding, const std_msgs::Header& header);
sensor_msgs::CameraInfo cameraInfo(const CameraIntrinsics& camera, const std_msgs::Header& header);

}  // namespace vip_slam
