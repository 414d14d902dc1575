// SPDX-License-Identifier: BSD-3-Clause
// Merges duplicate landmarks after a loop.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Joins features of keyframe `query` with landmarks of the map: a feature without landmark becomes an observation, a
/// feature's own landmark is merged into the given one. Two landmarks that are too far apart in the corrected map for
/// one point (3 cm and 2 % of the distance) are not merged. Returns the number joined.
int fuseLandmarks(Map& map, KeyframeId query, const std::vector<std::pair<std::uint32_t, LandmarkId>>& pairs);

}  // namespace vip_slam
