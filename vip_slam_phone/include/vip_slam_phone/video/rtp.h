// SPDX-License-Identifier: BSD-3-Clause
// RTP packets and RTCP sender reports (RFC 3550).
#pragma once

#include <optional>

#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {

struct RtpPacket {
  std::uint8_t payload_type = 0;
  bool marker = false;
  std::uint16_t sequence = 0;
  std::uint32_t time = 0;  ///< 90 kHz, any origin, wraps
  Bytes payload;           ///< within the parsed bytes
};
RtpPacket parseRtp(const Bytes& bytes);

struct SenderReport {
  double unix_time = 0;        ///< s
  std::uint32_t rtp_time = 0;  ///< the same instant
  /// Time of another RTP stamp of the stream: within 6.6 hours of the report.
  double timeOf(std::uint32_t rtp) const { return unix_time + static_cast<std::int32_t>(rtp - rtp_time) / 90000.0; }
};
/// The sender report in a compound RTCP packet; empty when it holds none.
std::optional<SenderReport> parseSenderReport(const Bytes& bytes);

}  // namespace vip_slam::phone
