// After a loop: landmarks that are one point become one landmark.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Joins what keyframe `query` saw in some features with landmarks of the map: a free feature gets the observation, a
/// feature with a landmark of its own merges it into the given one. Two landmarks that lie farther apart in the
/// corrected map than one point can (3 cm and 2 % of the distance) are left. Returns how many were joined.
int fuseLandmarks(Map& map, KeyframeId query, const std::vector<std::pair<std::uint32_t, LandmarkId>>& pairs);

}  // namespace vip_slam
