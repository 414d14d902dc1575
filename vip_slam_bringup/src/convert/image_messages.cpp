// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/convert/image_messages.h"

#include <cv_bridge/cv_bridge.h>

#include "vip_slam_ros/camera_info.h"

namespace vip_slam {

sensor_msgs::Image imageMessage(const cv::Mat& image, const std::string& encoding, const std_msgs::Header& header) {
  sensor_msgs::Image message;
  cv_bridge::CvImage(header, encoding, image).toImageMsg(message);
  return message;
}

sensor_msgs::CameraInfo cameraInfo(const CameraIntrinsics& camera, const std_msgs::Header& header) {
  sensor_msgs::CameraInfo info = toCameraInfo(camera);
  info.header = header;
  return info;
}

}  // namespace vip_slam
