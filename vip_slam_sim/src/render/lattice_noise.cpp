// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/lattice_noise.h"

#include <cmath>

namespace vip_slam {
namespace {

/// Nodes are this far apart: blended linearly, the correlation is a cubic B-spline, which is 1/e of its peak at 0.87
/// node distances.
constexpr float kNodes = 1 / 0.87f;

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

}  // namespace

float LatticeNoise::deviate(int x, int y, int t) const {
  const auto part = [](int i, std::uint64_t k) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) * k;
  };
  std::uint64_t z =
      mixed(seed_ + part(x, 0x9E3779B97F4A7C15ull) + part(y, 0xC2B2AE3D27D4EB4Full) + part(t, 0x165667B19E3779F9ull));
  // The sum of four uniform deviates is close enough to normal, and bounded: no field has wild values.
  float sum = 0;
  for (int k = 0; k < 4; ++k, z >>= 16) sum += static_cast<float>(z & 0xFFFF) / 65535.f - 0.5f;
  return sum * 1.7320508f;
}

float LatticeNoise::operator()(float x, float y, float t) const {
  const float at[3] = {x / kNodes, y / kNodes, t / kNodes};
  int node[3];
  float share[3], sum = 0, squares = 0;
  for (int k = 0; k < 3; ++k) {
    const float down = std::floor(at[k]);
    node[k] = static_cast<int>(down);
    share[k] = at[k] - down;
  }
  for (int corner = 0; corner < 8; ++corner) {
    float w = 1;
    int n[3];
    for (int k = 0; k < 3; ++k) {
      const int up = corner >> k & 1;
      n[k] = node[k] + up;
      w *= up ? share[k] : 1 - share[k];
    }
    if (w <= 0) continue;
    sum += w * deviate(n[0], n[1], n[2]);
    squares += w * w;
  }
  return sum / std::sqrt(squares);
}

}  // namespace vip_slam
