// SPDX-License-Identifier: BSD-3-Clause
// Descriptors for the place recognition tests: random places, and the same place seen again with flipped bits.
#pragma once

#include <random>
#include <vector>

#include "vip_slam_core/types/feature.h"

namespace vip_slam {

inline Descriptor randomDescriptor(std::mt19937_64& random) {
  Descriptor d;
  for (std::uint8_t& byte : d) byte = static_cast<std::uint8_t>(random() >> 56);
  return d;
}

inline Descriptor noisy(Descriptor d, double flip, std::mt19937_64& random) {
  for (int bit = 0; bit < 256; ++bit)
    if (static_cast<double>(random() >> 11) * 0x1.0p-53 < flip)
      d[bit >> 3] ^= static_cast<std::uint8_t>(1 << (bit & 7));
  return d;
}

/// `count` views drawn from a stock of appearances, as ORB features of real scenes are not uniformly random.
inline std::vector<Descriptor> randomImage(const std::vector<Descriptor>& stock, int count, std::mt19937_64& random) {
  std::vector<Descriptor> image;
  for (int k = 0; k < count; ++k) image.push_back(noisy(stock[random() % stock.size()], 0.08, random));
  return image;
}

inline std::vector<Descriptor> sameImage(const std::vector<Descriptor>& image, double flip, std::mt19937_64& random) {
  std::vector<Descriptor> again;
  for (const Descriptor& d : image)
    again.push_back(random() % 4 == 0 ? randomDescriptor(random) : noisy(d, flip, random));
  return again;
}

}  // namespace vip_slam
