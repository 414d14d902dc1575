// SPDX-License-Identifier: BSD-3-Clause
// Which poses are one place, and which keyframes look at the same scene.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// How far from the camera lies what a view shows, m.
constexpr double kSight = 3.0;

/// Whether two poses are the same place, within the differences of two matches of it.
inline bool samePlace(const SE3& a, const SE3& b) {
  return (a.t() - b.t()).norm() < 0.3 && a.rotation().angularDistance(b.rotation()) < 0.2;
}

/// Keyframes with a viewing direction similar to a camera at T_W_C, nearest views first, at most `most`; only those
/// accepted by `allowed` (empty: all).
std::vector<KeyframeId> viewsAlong(const Map& map, const SE3& T_W_C, std::size_t most,
                                   const std::function<bool(KeyframeId)>& allowed);

}  // namespace vip_slam
