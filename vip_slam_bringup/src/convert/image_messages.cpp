#include "vip_slam_bringup/convert/image_messages.h"

#include <cstring>
#include <stdexcept>

#include <sensor_msgs/distortion_models.h>

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

cv::Mat grayView(const sensor_msgs::Image& message) {
  if (message.encoding != "mono8" && message.encoding != "8UC1")
    throw std::invalid_argument("image has encoding '" + message.encoding + "', expected mono8");
  if (message.data.size() < static_cast<std::size_t>(message.step) * message.height || message.step < message.width)
    throw std::invalid_argument("image holds fewer bytes than its size says");
  return cv::Mat(message.height, message.width, CV_8UC1, const_cast<std::uint8_t*>(message.data.data()), message.step);
}

sensor_msgs::CameraInfo cameraInfo(const CameraIntrinsics& camera, const std_msgs::Header& header) {
  sensor_msgs::CameraInfo info;
  info.header = header;
  info.width = camera.width;
  info.height = camera.height;
  if (camera.model == DistortionModel::kEquidistant) {
    info.distortion_model = "equidistant";
    info.D = camera.distortion;
  } else {
    info.distortion_model = camera.distortion.size() > 5 ? sensor_msgs::distortion_models::RATIONAL_POLYNOMIAL
                                                         : sensor_msgs::distortion_models::PLUMB_BOB;
    if (camera.model == DistortionModel::kRadTan) info.D = camera.distortion;
    if (info.D.size() < 5) info.D.resize(5, 0.0);
  }
  info.K = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

}  // namespace vip_slam
