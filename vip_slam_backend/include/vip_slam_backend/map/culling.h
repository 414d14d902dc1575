// Keeps the map small: landmarks that never proved themselves, keyframes that others make redundant.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Removes landmarks with fewer than three views once their track ended, and those with hardly more that are predicted
/// into keyframes far more often than found. Landmarks that a keyframe at or above `recent` sees are spared. Returns
/// their number.
int cullLandmarks(KeyframeId recent, Map* map);

/// Removes keyframes outside the newest `window` whose landmarks are seen elsewhere, at least `redundancy` of them by
/// three other keyframes: of a map that is too large those that just left the window; and a few, just left or older,
/// of those that share landmarks with too many others, where landmarks that fewer see do not count. Never the first of
/// a chain, one that alone holds a plane, one whose removal would tear the IMU chain, or the end of a loop (in a crowd
/// only of the oldest few between each two odometries, which tie these). `loops`: (query, match), oldest first.
std::vector<KeyframeId> cullKeyframes(const CullingOptions& options, int window, const ImuNoise& noise,
                                      const std::vector<std::pair<KeyframeId, KeyframeId>>& loops, Map* map);

}  // namespace vip_slam
