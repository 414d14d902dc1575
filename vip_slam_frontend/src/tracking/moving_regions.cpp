// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/moving_regions.h"

#include <cmath>

namespace vip_slam {

namespace {

// Fewer moving points than this, or a smaller share of all points, are taken for mismatches.
constexpr std::size_t kMinFeatures = 5;
constexpr double kMinShare = 0.08;
// A pixel belongs to a moving body only within this distance of a moving point, px, unless nearly all points move.
constexpr float kReach = 120.0f;
constexpr std::size_t kNearlyAll = 4;  // moving points for each that stands still
// Largest difference in depth from the moving point, as a share of its depth.
constexpr double kDeep = 0.2;

}  // namespace

void MovingRegions::add(const Eigen::Vector2f& pixel, double z, bool still) {
  (still ? still_ : moving_).push_back({pixel, static_cast<float>(z)});
}

bool MovingRegions::any() const {
  return moving_.size() >= kMinFeatures &&
         static_cast<double>(moving_.size()) > kMinShare * static_cast<double>(moving_.size() + still_.size());
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
  const float distance = nearest(moving_, p, &moving);
  if (distance >= nearest(still_, p, &still)) return false;
  if (distance > kReach * kReach && moving_.size() <= kNearlyAll * still_.size()) return false;
  return !(z > 0) || !(moving->z > 0) || std::abs(z - moving->z) < kDeep * moving->z;
}

}  // namespace vip_slam
