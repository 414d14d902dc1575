// SPDX-License-Identifier: BSD-3-Clause
// Fixes the gauge (not in the paper), which no measurement of an inertial problem observes: position and yaw of one
// keyframe. Four rows; at the minimum they are zero, so their weight changes nothing but the conditioning.
//   r = w (p - p_0, e_z . Log(R R_0^T)),  d Log / d theta = J_r^-1(phi) R_0.
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct GaugePrior {
  SE3 T_W_I;            ///< the pose that is held
  double weight = 1e3;  ///< 1/m and 1/rad
  bool tilt = false;    ///< hold roll and pitch as well (no IMU factor in the problem)
};

/// Rows: position (3), yaw (or all of the rotation vector when tilt).
inline Vector6d gaugeResidual(const GaugePrior& prior, const SE3& T_W_I, Matrix6d* J = nullptr) {
  const Eigen::Vector3d phi = logSO3(T_W_I.rotation() * prior.T_W_I.rotation().conjugate());
  Vector6d r;
  r.head<3>() = prior.weight * (T_W_I.t() - prior.T_W_I.t());
  const Eigen::Vector3d mask = prior.tilt ? Eigen::Vector3d(1, 1, 1) : Eigen::Vector3d(0, 0, 1);
  r.tail<3>() = prior.weight * mask.cwiseProduct(phi);
  if (J) {
    J->setZero();
    J->topRightCorner<3, 3>() = prior.weight * Eigen::Matrix3d::Identity();
    J->bottomLeftCorner<3, 3>() = prior.weight * mask.asDiagonal() * rightJacobianInverseSO3(phi) * prior.T_W_I.R();
  }
  return r;
}

}  // namespace vip_slam
