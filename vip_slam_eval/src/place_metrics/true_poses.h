// SPDX-License-Identifier: BSD-3-Clause
// True poses of the keyframes of a stored map.
#pragma once

#include <map>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

using TruePoses = std::map<KeyframeId, SE3>;

/// Keyframes with their true poses (IMU); those outside the truth are left out.
TruePoses truePoses(const Map& map, const Trajectory& truth);

/// T_truth_map: yaw and position, least squares over the positions and orientations of keyframes. Throws
/// std::invalid_argument when the truth has none of them.
SE3 alignMap(const Map& map, const TruePoses& truth);

/// Within so many metres and 30 degrees.
bool samePlace(const SE3& a, const SE3& b, double metres);

}  // namespace vip_slam
