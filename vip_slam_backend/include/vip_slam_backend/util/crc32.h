// SPDX-License-Identifier: BSD-3-Clause
// CRC-32 (IEEE 802.3 polynomial, reflected), the checksum of our files.
#pragma once

#include <cstddef>
#include <cstdint>

#include <boost/crc.hpp>

namespace vip_slam {

inline std::uint32_t crc32(const void* data, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(data, size);
  return crc.checksum();
}

}  // namespace vip_slam
