// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/views.h"

#include <algorithm>
#include <utility>

namespace vip_slam {
namespace {

constexpr double kFarthestView = 6.0, kCosineOfView = 0.5;  // m; beyond, little of what one view shows is in the other
constexpr double kMetresPerCosine = 4.0;                    // weight of a change of direction against one of position

}  // namespace

std::vector<KeyframeId> viewsAlong(const Map& map, const SE3& T_W_C, std::size_t most,
                                   const std::function<bool(KeyframeId)>& allowed) {
  const Eigen::Vector3d forward = T_W_C.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& entry : map.keyframes()) {
    const SE3 other = entry.second.T_W_C();
    const double cosine = forward.dot(other.rotation() * Eigen::Vector3d::UnitZ());
    const double distance = (other.t() - T_W_C.t()).norm();
    if (cosine < kCosineOfView || distance > kFarthestView || (allowed && !allowed(entry.first))) continue;
    near.emplace_back(distance + kMetresPerCosine * (1.0 - cosine), entry.first);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > most) near.resize(most);
  std::vector<KeyframeId> views;
  for (const auto& view : near) views.push_back(view.second);
  return views;
}

}  // namespace vip_slam
