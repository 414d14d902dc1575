// CRC-32 (IEEE 802.3 polynomial, reflected), the checksum of our files.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vip_slam {

/// `seed` is the CRC of what came before: crc32(b, crc32(a)) is the CRC of a followed by b.
std::uint32_t crc32(const void* data, std::size_t size, std::uint32_t seed = 0);

}  // namespace vip_slam
