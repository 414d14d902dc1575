// SPDX-License-Identifier: BSD-3-Clause
// Trajectories from text files as data sets publish them, and the order of their quaternions.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

/// The format is told by the first row of numbers:
///   8 numbers between blanks: TUM, "t tx ty tz qx qy qz qw";
///   commas: EuRoC's csv, "t, px, py, pz, qw, qx, qy, qz, ...";
///   12 numbers between blanks: KITTI, the rows of a 3 x 4 matrix; it needs `times`, a file with one stamp per pose,
///   which is for this format only.
/// The unit of stamps is told by secondsPerUnit. Throws std::runtime_error "file:line: what, expected what" when it is
/// none of these, a number or a pose cannot be read, or stamps do not ascend; a TUM pose that repeats a stamp is left
/// out. `ran_back`: as for readTum.
Trajectory readTextTrajectory(const std::string& path, const std::string& times = "", std::string* ran_back = nullptr);

/// Whether the quaternions of this file's format begin with their scalar; none: it has no quaternions, or is a bag.
std::optional<bool> scalarFirst(const std::string& path);

/// The same file read in the other order: its quaternions have the scalar where `scalar_first` says, and were read as
/// if it stood at the other end.
Trajectory rereadQuaternions(const Trajectory& trajectory, bool scalar_first);

/// Whether the truth's quaternions are in the order they were read in. Lengths and angles of steps are the same in both
/// orders and the trajectory is as smooth; but the axes of the steps fit those of the estimate, but for one constant
/// turn between the two bodies, in one order only.
struct QuaternionOrder {
  bool swapped = false;  ///< read in the other order the steps fit, and as they were read they do not
  double misfit = 0;     ///< RMS of what the constant turn leaves of the steps of about a second, rad
  double misfit_swapped = 0;
  double turning = 0;  ///< RMS of the steps themselves, rad
};
/// `reread`: the truth in the other order. Stamps of the estimate plus `time_offset` are the truth's. Too little
/// rotation, or one about a single axis, fits both orders and is not called swapped.
QuaternionOrder quaternionOrder(const Trajectory& truth, const Trajectory& reread, const Trajectory& estimate,
                                double time_offset, double max_gap);

}  // namespace vip_slam
