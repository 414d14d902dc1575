// SPDX-License-Identifier: BSD-3-Clause
// libFuzzer target: whatever the bytes, reading a map gives a consistent map or a std::runtime_error.
// The checksum is made right first, else the fuzzer would only ever see the checksum's error.
#include <cstdlib>
#include <cstring>
#include <string>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/util/crc32.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes(reinterpret_cast<const char*>(data), size);
  if (size >= 28) {
    const std::uint64_t length = size - 28;
    std::memcpy(&bytes[16], &length, 8);
    const std::uint32_t crc = vip_slam::crc32(bytes.data(), size - 4);
    std::memcpy(&bytes[size - 4], &crc, 4);
  }
  try {
    const vip_slam::StoredMap stored = vip_slam::parseMap(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                                          bytes.size(), "fuzz", vip_slam::ImuNoise());
    if (!vip_slam::checkMap(stored.map).empty()) std::abort();
    // What was read can be written, and read again to the same bytes.
    const std::string again = vip_slam::serialiseMap(stored.map, stored.loops, stored.vocabulary_id, stored.camera);
    const vip_slam::StoredMap twice = vip_slam::parseMap(reinterpret_cast<const std::uint8_t*>(again.data()),
                                                         again.size(), "fuzz", vip_slam::ImuNoise());
    if (vip_slam::serialiseMap(twice.map, twice.loops, twice.vocabulary_id, twice.camera) != again) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
