// SPDX-License-Identifier: BSD-3-Clause
// Trajectories in TUM format: "timestamp tx ty tz qx qy qz qw", one pose per line, '#' comments.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct StampedPose {
  double t = 0;  ///< s
  SE3 T_W_B;     ///< body in the world, m; the file says which frames these are
};
using Trajectory = std::vector<StampedPose>;

/// Stamps may also be in milliseconds, microseconds or nanoseconds (stamp_unit.h). A pose that repeats the stamp of the
/// one before is left out. Throws std::runtime_error "file:line: what, expected
/// what" on a missing file, malformed line, non-finite number, or a quaternion whose length is 5 % or more off 1.
/// Where stamps run backwards, as after a clock was set back, poses are left out until time goes on; `ran_back` tells,
/// and without it such a file is refused.
Trajectory readTum(const std::string& path, std::string* ran_back = nullptr);
/// Stamps with 9 decimals, values with 9; whole or not at all.
void writeTum(const std::string& path, const Trajectory& trajectory);

/// Pose at t by interpolation between neighbours at most `max_gap` apart; false outside.
bool poseAt(const Trajectory& trajectory, double t, SE3* T_W_B, double max_gap = 0.1);

}  // namespace vip_slam
