// SPDX-License-Identifier: BSD-3-Clause
#include "rtp_writer.h"

#include <algorithm>
#include <cmath>

namespace vip_slam::phone {
namespace {

using Raw = std::vector<std::uint8_t>;

constexpr std::size_t kLongest = 1400;  // bytes of a unit in a packet

void big(Raw* out, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
}

/// What a fragment begins with: the unit's own header, with its type moved into a byte that says first or last.
Raw fragmentHeader(Codec codec, const Raw& unit, bool first, bool last) {
  const int ends = (first ? 0x80 : 0) | (last ? 0x40 : 0);
  if (codec == Codec::kH264)
    return {static_cast<std::uint8_t>((unit[0] & 0xe0) | 28), static_cast<std::uint8_t>(ends | (unit[0] & 0x1f))};
  return {static_cast<std::uint8_t>((unit[0] & 0x81) | 49 << 1), unit[1],
          static_cast<std::uint8_t>(ends | (unit[0] >> 1 & 0x3f))};
}

}  // namespace

std::vector<Raw> RtpWriter::packets(const std::vector<Raw>& units, std::uint32_t rtp_time) {
  std::vector<Raw> out;
  const auto packet = [&](const Raw& header, Raw::const_iterator begin, Raw::const_iterator end) {
    Raw bytes = {0x80, kPayloadType};
    big(&bytes, sequence_++, 2);
    big(&bytes, rtp_time, 4);
    big(&bytes, 0x01020304, 4);
    bytes.insert(bytes.end(), header.begin(), header.end());
    bytes.insert(bytes.end(), begin, end);
    out.push_back(std::move(bytes));
  };
  const std::size_t own = codec_ == Codec::kH264 ? 1 : 2;  // bytes of a unit's header
  for (const Raw& unit : units) {
    if (unit.size() <= kLongest) {
      packet({}, unit.begin(), unit.end());
      continue;
    }
    for (std::size_t at = own; at < unit.size(); at += kLongest) {
      const std::size_t end = std::min(at + kLongest, unit.size());
      packet(fragmentHeader(codec_, unit, at == own, end == unit.size()), unit.begin() + at, unit.begin() + end);
    }
  }
  if (!out.empty()) out.back()[1] |= 0x80;
  return out;
}

Raw RtpWriter::report(double unix_time, std::uint32_t rtp_time) {
  Raw out = {0x80, 200, 0, 6, 1, 2, 3, 4};
  const double ntp = unix_time + 2208988800.0;
  big(&out, static_cast<std::uint32_t>(ntp), 4);
  big(&out, static_cast<std::uint32_t>((ntp - std::floor(ntp)) * 4294967296.0), 4);
  big(&out, rtp_time, 4);
  big(&out, 0, 4);
  big(&out, 0, 4);
  return out;
}

}  // namespace vip_slam::phone
