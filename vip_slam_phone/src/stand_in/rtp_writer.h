// SPDX-License-Identifier: BSD-3-Clause
// Pictures to RTP packets, as a phone sends them: single units and fragments.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_phone/video/depacketiser.h"

namespace vip_slam::phone {

class RtpWriter {
 public:
  explicit RtpWriter(Codec codec) : codec_(codec) {}
  /// Of one picture, whose units come without start codes; the last packet bears the marker.
  std::vector<std::vector<std::uint8_t>> packets(const std::vector<std::vector<std::uint8_t>>& units,
                                                 std::uint32_t rtp_time);
  /// RTCP sender report: the same instant on both clocks.
  static std::vector<std::uint8_t> report(double unix_time, std::uint32_t rtp_time);

  static constexpr std::uint8_t kPayloadType = 96;

 private:
  Codec codec_;
  std::uint16_t sequence_ = 65000;  // wraps soon
};

}  // namespace vip_slam::phone
