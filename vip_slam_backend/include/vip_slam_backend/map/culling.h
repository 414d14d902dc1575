// SPDX-License-Identifier: BSD-3-Clause
// Keeps the map small: removes landmarks with too few views, and redundant keyframes.
#pragma once

#include <utility>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Removes landmarks with fewer than three views once their track has ended, and those with three views that were
/// predicted into keyframes at least five times as often as found. Landmarks seen by keyframes from `recent` on are
/// kept. Returns the number removed.
int cullLandmarks(KeyframeId recent, Map* map);

/// Removes redundant keyframes outside the newest `window`: at least the share `redundancy` of their landmarks is seen
/// by three other keyframes. In a map that is too large any candidate (those that just left the window, and the older
/// ones in turn) may go; else only a few at a time that share landmarks with too many keyframes (a crowd), where
/// landmarks with fewer views do not count. Never removed: the first and last of an IMU chain, one that too few others
/// replace on a plane, one whose removal would make an IMU factor too long, or the end of a loop (in a crowd only the
/// ends of the oldest loop between each two odometries, which ties these). `loops`: (query, match), oldest first.
std::vector<KeyframeId> cullKeyframes(const CullingOptions& options, int window, const ImuNoise& noise,
                                      const std::vector<std::pair<KeyframeId, KeyframeId>>& loops, Map* map);

}  // namespace vip_slam
