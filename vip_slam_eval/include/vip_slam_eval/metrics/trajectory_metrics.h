// SPDX-License-Identifier: BSD-3-Clause
// Errors of a trajectory against the truth: absolute error after alignment (ATE), relative errors over time and over
// distance (RPE). Poses are of the body (IMU); the truth's world and the estimate's world may differ.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_eval/metrics/statistics.h"

namespace vip_slam {

/// An estimated pose and the true one at the same time.
struct PosePair {
  double t = 0;  ///< stamp of the estimate, seconds
  SE3 T_W_B;     ///< truth
  SE3 T_M_B;     ///< estimate
};

/// Pairs each estimate with the truth interpolated at its stamp + time_offset, between neighbours at most `max_gap`
/// seconds apart. Estimates that the truth does not cover are left out.
std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate, double max_gap = 0.1,
                                double time_offset = 0.0);

/// What the alignment may change. A visual-inertial system observes gravity: with kYaw its error in roll and pitch
/// counts, kSe3 removes it.
enum class Alignment { kNone, kPosition, kYaw, kSe3 };
/// "none", "position", "yaw", "se3"; throws std::invalid_argument on others.
Alignment alignmentFromName(const std::string& name);
std::string alignmentName(Alignment alignment);

/// T_W_M that minimises the squared distances of the positions. Orientations have a small weight (see orientationWeight
/// in the source), to fix only what the positions leave undetermined. Throws std::invalid_argument without pairs.
SE3 align(const std::vector<PosePair>& pairs, Alignment alignment);

/// Errors of one pair after alignment.
struct PoseError {
  double t = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< estimate - truth, metres, truth's world
  double rotation = 0;                                 ///< angle, radians
};

struct AbsoluteError {
  SE3 T_W_M;
  ErrorStatistics position;  ///< metres
  ErrorStatistics rotation;  ///< degrees
  std::vector<PoseError> errors;
};
AbsoluteError absoluteError(const std::vector<PosePair>& pairs, Alignment alignment);

struct RelativeError {
  double delta = 0;          ///< seconds or metres
  ErrorStatistics position;  ///< metres over delta
  ErrorStatistics rotation;  ///< degrees over delta
};
/// Over pairs `seconds` apart, to within half a mean interval.
RelativeError relativeErrorOverTime(const std::vector<PosePair>& pairs, double seconds);
/// Over pairs at least `metres` of the true path apart (the first that are).
RelativeError relativeErrorOverDistance(const std::vector<PosePair>& pairs, double metres);

/// Length of the true path over the pairs, metres.
double truePathLength(const std::vector<PosePair>& pairs);

}  // namespace vip_slam
