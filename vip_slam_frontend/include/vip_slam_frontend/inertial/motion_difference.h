// SPDX-License-Identifier: BSD-3-Clause
// The camera's motion over an interval by the IMU, compared with the one that images show. Motions are
// T_current_previous, their errors (theta, t) as of SE3::boxplus(), rad and m.
#pragma once

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_frontend/filter/propagation.h"

namespace vip_slam::frontend {

/// Covariance of the motion that `propagation` predicts for the camera; `P` of the state that it began from.
Matrix6d motionCovariance(const Propagation& propagation, const Matrix15d& P, const SE3& T_I_C);
/// Adds the errors that no covariance of `motion` has: `constant` (rad and m) and a share of it.
void admitMotionError(const SE3& motion, double constant, Matrix6d* covariance);
/// Difference of two motions, as a number of sigmas; `covariance`: of both.
double motionDifference(const SE3& a, const SE3& b, const Matrix6d& covariance);

}  // namespace vip_slam::frontend
