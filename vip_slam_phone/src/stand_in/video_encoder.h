// H.264 by libx264, as a phone's encoder makes it: no B pictures, a key picture a second.
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

namespace vip_slam::phone {

class VideoEncoder {
 public:
  /// Throws std::runtime_error where libavcodec has no libx264.
  VideoEncoder(cv::Size size, int rate, int bits_per_second);
  ~VideoEncoder();
  /// The units of the picture, without start codes.
  std::vector<std::vector<std::uint8_t>> encode(const cv::Mat& bgr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam::phone
