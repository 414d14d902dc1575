// SPDX-License-Identifier: BSD-3-Clause
// What the back end knows of its place in a stored map, and what waits until it may map.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "vip_slam_backend/map/map_snapshot.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct Localisation {
  bool only = false;                      ///< localisation-only mode: the map does not change; outlives a reset
  bool searching = false;                 ///< a loaded map is not recognised yet
  std::deque<KeyframePtr> held;           ///< received while searching, inserted once the map is recognised
  std::vector<PlaneUpdate> held_updates;  ///< received in localisation-only mode, applied when mapping goes on
  std::vector<Anchor> localised;          ///< keyframes localised in the map without entering it

  /// Localisation-only mode: the last keyframe found in the map, to which the odometry is tied when mapping goes on.
  struct LastFound {
    std::uint32_t epoch = 0;
    KeyframeId match = 0;
    double t = 0;
    bool newest = true;  ///< no keyframe since then was looked for in vain
  };
  std::optional<LastFound> last_found;

  void reset() { *this = Localisation{only}; }
};

}  // namespace vip_slam
