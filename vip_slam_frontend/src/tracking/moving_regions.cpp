// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/moving_regions.h"

#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

// Largest difference in depth from the moving point, as a share of its depth.
constexpr double kDeep = 0.2;

}  // namespace

bool areMismatches(int outliers, int points) {
  const double expected = (1 - kGateProbability) * points;
  double fewer = 0, probability = std::exp(-expected);
  for (int k = 0; k < outliers; ++k) {
    fewer += probability;
    probability *= expected / (k + 1);
  }
  return fewer < kGateProbability;
}

void MovingRegions::add(const Eigen::Vector2f& pixel, double z, bool still) {
  (still ? still_ : moving_).push_back({pixel, static_cast<float>(z)});
}

bool MovingRegions::any() const {
  return !areMismatches(static_cast<int>(moving_.size()), static_cast<int>(moving_.size() + still_.size()));
}

float MovingRegions::nearest(const std::vector<Mark>& marks, const Eigen::Vector2f& pixel, const Mark** mark) {
  float best = 1e30f;
  for (const Mark& m : marks) {
    const float d = (m.pixel - pixel).squaredNorm();
    if (d >= best) continue;
    best = d;
    *mark = &m;
  }
  return best;
}

bool MovingRegions::moves(const Eigen::Vector2d& pixel, double z) const {
  if (!any()) return false;
  const Eigen::Vector2f p = pixel.cast<float>();
  const Mark *moving = nullptr, *still = nullptr;
  if (nearest(moving_, p, &moving) >= nearest(still_, p, &still)) return false;
  return !(z > 0) || !(moving->z > 0) || std::abs(z - moving->z) < kDeep * moving->z;
}

}  // namespace vip_slam
