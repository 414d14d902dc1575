// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/views.h"

#include <algorithm>
#include <utility>

namespace vip_slam {

std::vector<KeyframeId> viewsAlong(const Map& map, const SE3& T_W_C, std::size_t most,
                                   const std::function<bool(KeyframeId)>& allowed) {
  const Eigen::Vector3d forward = T_W_C.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& entry : map.keyframes()) {
    const SE3 other = entry.second.T_W_C();
    const Eigen::Vector3d turned = other.rotation() * Eigen::Vector3d::UnitZ() - forward;
    const double apart = (other.t() - T_W_C.t()).norm() + kSight * turned.norm();
    // Farther apart, little of what one view shows is in the other.
    if (apart > 2 * kSight || (allowed && !allowed(entry.first))) continue;
    near.emplace_back(apart, entry.first);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > most) near.resize(most);
  std::vector<KeyframeId> views;
  for (const auto& view : near) views.push_back(view.second);
  return views;
}

}  // namespace vip_slam
