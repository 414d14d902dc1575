// SPDX-License-Identifier: BSD-3-Clause
// What writer and reader of map files share.
#pragma once

#include <cstdint>

namespace vip_slam {
namespace map_file {

/// By what each version stores for the first time; all of them are read.
enum class Version : std::uint32_t { kFirst = 1, kPixelSigma, kTracks, kMotion, kCamera, kNoiseScale, kWalkScales };

/// As it lies in memory, before the payload.
struct Header {
  char magic[8] = {'V', 'I', 'P', 'M', 'A', 'P', 0, 0};
  Version version = Version::kWalkScales;
  std::uint32_t reserved = 0;
  std::uint64_t payload_bytes = 0;
};
static_assert(sizeof(Header) == 8 + 4 + 4 + 8, "the header has no padding");

constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;
constexpr double kDepthUnit = 0.001;  ///< metres per unit of a stored depth grid

}  // namespace map_file
}  // namespace vip_slam
