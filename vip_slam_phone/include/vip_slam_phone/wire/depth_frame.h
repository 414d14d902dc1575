// SPDX-License-Identifier: BSD-3-Clause
// Depth images from the phone.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {

struct DepthFrame {
  std::uint16_t sequence = 0;
  double host_time = 0, unix_time = 0;  ///< s
  cv::Mat metres;                       ///< 32FC1, along the optical axis, 0 = invalid
};

constexpr std::size_t kDepthHeader = 32;
/// Longest message that is believed: 1024 x 1024 floats and the header.
constexpr std::size_t kMaxDepthMessage = (1 << 22) + kDepthHeader;

/// A header of 32 bytes and the map: half or single floats, raw or DEFLATE. Throws WireError on anything else; of LZFSE
/// it says that it is not supported.
DepthFrame parseDepthFrame(const Bytes& message);

/// The message that asks for DEFLATE (length and JSON).
std::vector<std::uint8_t> askForDeflate();

}  // namespace vip_slam::phone
