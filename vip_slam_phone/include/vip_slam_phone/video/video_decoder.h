// SPDX-License-Identifier: BSD-3-Clause
// H.264 and HEVC by libavcodec.
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_phone/video/depacketiser.h"

namespace vip_slam::phone {

struct DecodedImage {
  cv::Mat bgr;
  std::uint32_t rtp_time = 0;
};

class VideoDecoder {
 public:
  /// Throws std::runtime_error when libavcodec has no decoder for it.
  explicit VideoDecoder(Codec codec);
  ~VideoDecoder();

  /// The images that become ready; the stream holds no picture back (no B pictures), so this one's. Damaged data give
  /// no image and no exception: after a loss nothing comes out until the next key picture.
  std::vector<DecodedImage> decode(const std::vector<std::uint8_t>& data, std::uint32_t rtp_time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam::phone
