// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "vip_slam_sim/scene/vec.h"

namespace vip_slam {

/// Cosine-weighted directions about +z on a Fibonacci spiral.
inline std::vector<Vec3> hemisphere(int count) {
  std::vector<Vec3> out;
  for (int i = 0; i < count; ++i) {
    const float r = std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(count));
    const float a = 2.39996323f * static_cast<float>(i);
    out.push_back({r * std::cos(a), r * std::sin(a), std::sqrt(std::max(0.f, 1 - r * r))});
  }
  return out;
}

}  // namespace vip_slam
