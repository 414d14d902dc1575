// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/types/feature.h"

#include <cstring>

namespace vip_slam {

int hammingDistance(const Descriptor& a, const Descriptor& b) {
  // Baseline x86-64 has no popcount instruction: add bit fields, with the later steps shared by pairs of words.
  constexpr std::uint64_t k1 = 0x5555555555555555u, k2 = 0x3333333333333333u, k4 = 0x0F0F0F0F0F0F0F0Fu;
  std::uint64_t x[4], y[4];
  std::memcpy(x, a.data(), 32);
  std::memcpy(y, b.data(), 32);
  for (int k = 0; k < 4; ++k) {
    x[k] ^= y[k];
    x[k] -= (x[k] >> 1) & k1;
    x[k] = (x[k] & k2) + ((x[k] >> 2) & k2);
  }
  x[0] += x[1];
  x[2] += x[3];
  const std::uint64_t bytes = (x[0] & k4) + ((x[0] >> 4) & k4) + (x[2] & k4) + ((x[2] >> 4) & k4);
  return static_cast<int>((bytes * 0x0101010101010101u) >> 56);
}

}  // namespace vip_slam
