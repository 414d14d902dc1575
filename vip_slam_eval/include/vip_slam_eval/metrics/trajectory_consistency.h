// SPDX-License-Identifier: BSD-3-Clause
// Completeness of a trajectory, and consistency of its covariances with its errors (NEES).
#pragma once

#include <vector>

#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_eval/metrics/statistics.h"

namespace vip_slam {

struct Gap {
  double begin = 0, end = 0;  ///< seconds
};

/// How much of the truth's duration the estimate covers. Gaps include missing time before the first and after the last
/// estimated pose.
struct Coverage {
  double fraction = 0;  ///< of the truth's duration that lies outside gaps
  std::vector<Gap> gaps;
  double longest_gap = 0;  ///< seconds
};
Coverage coverage(const Trajectory& truth, const Trajectory& estimate, double gap_seconds, double time_offset = 0.0);

/// A pose with the covariance it was published with.
struct PoseWithCovariance {
  double t = 0;
  SE3 T_M_B;
  /// ROS order and frames: x y z in M, then rotation about the axes of M.
  Matrix6d covariance = Matrix6d::Zero();
};

/// Error of a pose after aligning the truth to the first estimated pose in position and yaw, because the filter's
/// covariance is relative to its start. `level` false: in position and rotation, where the tilt is part of the start
/// (no IMU with a gyroscope).
struct JoinedError {
  double t = 0;
  Vector6d error = Vector6d::Zero();  ///< x y z, rotation, both in M; metres and radians
  Matrix6d covariance = Matrix6d::Zero();
  double nees = 0;  ///< negative when the covariance is not positive definite
};
std::vector<JoinedError> joinedErrors(const Trajectory& truth, const std::vector<PoseWithCovariance>& estimate,
                                      double max_gap = 0.1, double time_offset = 0.0, bool level = true);

/// Normalised estimation error squared: e^T P^-1 e. Its mean is the number of degrees of freedom for a consistent
/// filter.
struct Nees {
  ErrorStatistics pose;      ///< 6 degrees of freedom
  ErrorStatistics position;  ///< 3
  ErrorStatistics rotation;  ///< 3
  double within_95 = 0;      ///< fraction of poses below the 95 % bound of chi-square with 6 degrees of freedom
  std::size_t unusable = 0;  ///< covariances that are not positive definite
};
Nees nees(const Trajectory& truth, const std::vector<PoseWithCovariance>& estimate, double max_gap = 0.1,
          double time_offset = 0.0, bool level = true);

}  // namespace vip_slam
