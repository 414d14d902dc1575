// SPDX-License-Identifier: BSD-3-Clause
// H.264 by libx264 and HEVC by libx265, as a phone's encoder makes it: no B pictures, a key picture a second.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_phone/video/depacketiser.h"

namespace vip_slam::phone {

class VideoEncoder {
 public:
  /// Whether libavcodec has the encoder.
  static bool available(Codec codec);
  /// Throws std::runtime_error where it has not.
  VideoEncoder(Codec codec, cv::Size size, int rate, int bits_per_second);
  ~VideoEncoder();
  /// The units of the picture, without start codes.
  std::vector<std::vector<std::uint8_t>> encode(const cv::Mat& bgr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string name_;
};

}  // namespace vip_slam::phone
