// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/rtp.h"

namespace vip_slam::phone {

RtpPacket parseRtp(const Bytes& bytes) {
  if (bytes[0] >> 6 != 2) throw WireError("RTP packet of version " + std::to_string(bytes[0] >> 6) + ", expected 2");
  RtpPacket packet;
  packet.marker = bytes[1] & 0x80;
  packet.payload_type = bytes[1] & 0x7f;
  packet.sequence = bytes.big<std::uint16_t>(2);
  packet.time = bytes.big<std::uint32_t>(4);
  std::size_t at = 12 + 4 * (bytes[0] & 0x0f);
  if (bytes[0] & 0x10) at += 4 + 4 * std::size_t(bytes.big<std::uint16_t>(at + 2));
  packet.payload = bytes.from(at);
  if (bytes[0] & 0x20) {
    const std::size_t size = packet.payload.size(), padding = size ? packet.payload[size - 1] : 0;
    if (padding == 0 || padding > size) throw WireError("RTP packet: padding longer than its payload");
    packet.payload = packet.payload.part(0, size - padding);
  }
  return packet;
}

std::optional<SenderReport> parseSenderReport(const Bytes& bytes) {
  constexpr double kNtpToUnix = 2208988800.0;
  for (Bytes rest = bytes; rest.size() >= 4;) {
    if (rest[0] >> 6 != 2) throw WireError("RTCP packet of another version than 2");
    const std::size_t length = 4 * (1 + std::size_t(rest.big<std::uint16_t>(2)));
    const Bytes packet = rest.part(0, length);
    if (packet[1] == 200) {
      SenderReport report;
      report.unix_time = packet.big<std::uint32_t>(8) - kNtpToUnix + packet.big<std::uint32_t>(12) / 4294967296.0;
      report.rtp_time = packet.big<std::uint32_t>(16);
      return report;
    }
    rest = rest.from(length);
  }
  return {};
}

}  // namespace vip_slam::phone
