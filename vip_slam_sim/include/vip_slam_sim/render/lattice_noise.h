// SPDX-License-Identifier: BSD-3-Clause
// Smooth random fields over image and time that are read at any place in any order: a lattice of normal deviates, each
// a hash of its coordinates, blended linearly and scaled to unit variance.
#pragma once

#include <cstdint>

namespace vip_slam {

class LatticeNoise {
 public:
  explicit LatticeNoise(std::uint64_t seed) : seed_(seed) {}

  /// Correlation falls to 1/e over a distance of 1 along each axis. Zero mean, unit variance.
  float operator()(float x, float y, float t) const;
  float operator()(float t) const { return (*this)(0.f, 0.f, t); }
  /// Another field of the same kind.
  LatticeNoise other(std::uint64_t which) const { return LatticeNoise(seed_ + 0x632BE59BD9B4E019ull * (which + 1)); }

 private:
  float deviate(int x, int y, int t) const;

  std::uint64_t seed_;
};

}  // namespace vip_slam
