// SPDX-License-Identifier: BSD-3-Clause
// Messages as the phone writes them, for tests, and their damage.
#pragma once

#include <cstring>
#include <random>
#include <vector>

namespace vip_slam::phone {

using Raw = std::vector<std::uint8_t>;

/// The machine that runs the tests is little-endian, as the phone is.
template <typename T>
void put(Raw* bytes, std::size_t at, T value) {
  std::memcpy(bytes->data() + at, &value, sizeof(T));
}

inline Raw record(std::uint8_t type, std::uint16_t sequence, double host, double unix_time) {
  Raw bytes(64, 0);
  bytes[0] = type;
  put(&bytes, 2, sequence);
  put(&bytes, 8, host);
  put(&bytes, 16, unix_time);
  return bytes;
}

/// Bits turned over, cut off, grown.
inline Raw damaged(Raw bytes, std::mt19937* random) {
  const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(*random); };
  for (std::size_t i = 0, n = 1 + pick(6); i < n && !bytes.empty(); ++i)
    bytes[pick(bytes.size())] = static_cast<std::uint8_t>(pick(256));
  if (pick(3) == 0) bytes.resize(pick(bytes.size() + 1));
  if (pick(5) == 0) bytes.resize(bytes.size() + pick(40), static_cast<std::uint8_t>(pick(256)));
  return bytes;
}

}  // namespace vip_slam::phone
