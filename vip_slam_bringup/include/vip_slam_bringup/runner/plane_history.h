// SPDX-License-Identifier: BSD-3-Clause
// Where each plane lay after each map update, to judge how steady planes are (plane_history.csv).
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

struct PlaneRecord {
  double t = 0;  ///< stamp of the newest keyframe
  PlaneId id = 0;
  Plane plane;  ///< in `map`
};

/// Whole or not at all; throws std::runtime_error when it cannot be written.
void writePlaneHistory(const std::string& path, const std::vector<PlaneRecord>& history);

}  // namespace vip_slam
