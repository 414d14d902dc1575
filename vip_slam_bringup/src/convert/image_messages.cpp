#include "vip_slam_bringup/convert/image_messages.h"

#include <cstring>

#include "vip_slam_ros/camera_info.h"

namespace vip_slam {

sensor_msgs::Image imageMessage(const cv::Mat& image, const std::string& encoding, const std_msgs::Header& header) {
  sensor_msgs::Image message;
  message.header = header;
  message.height = image.rows;
  message.width = image.cols;
  message.encoding = encoding;
  message.is_bigendian = 0;
  message.step = static_cast<std::uint32_t>(image.cols * image.elemSize());
  message.data.resize(static_cast<std::size_t>(message.step) * message.height);
  for (int v = 0; v < image.rows; ++v)
    std::memcpy(&message.data[static_cast<std::size_t>(v) * message.step], image.ptr(v), message.step);
  return message;
}

sensor_msgs::CameraInfo cameraInfo(const CameraIntrinsics& camera, const std_msgs::Header& header) {
  sensor_msgs::CameraInfo info = toCameraInfo(camera);
  info.header = header;
  return info;
}

}  // namespace vip_slam
