// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/motion_difference.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

Matrix6d motionCovariance(const Propagation& propagation, const Matrix15d& P, const SE3& T_I_C) {
  const Eigen::Matrix3d R_C_I = T_I_C.R().transpose();
  const Eigen::Matrix3d R_C_W = R_C_I * propagation.predicted.T_W_I.R().transpose();
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = R_C_I * propagation.turnCovariance(P) * R_C_I.transpose();
  covariance.bottomRightCorner<3, 3>() = R_C_W * propagation.displacementCovariance(P) * R_C_W.transpose();
  return covariance;
}

void admitMotionError(const SE3& motion, double constant, Matrix6d* covariance) {
  const auto variance = [constant](double size) {
    return std::pow(constant, 2) + std::pow(kMotionErrorShare * size, 2);
  };
  covariance->diagonal().head<3>().array() += variance(logSO3(motion.R()).norm());
  covariance->diagonal().tail<3>().array() += variance(motion.t().norm());
}

double motionDifference(const SE3& a, const SE3& b, const Matrix6d& covariance) {
  const Vector6d d = a.boxminus(b);
  const double squared = d.dot(covariance.ldlt().solve(d));
  return std::isfinite(squared) ? std::sqrt(std::max(0.0, squared)) : 0.0;
}

}  // namespace vip_slam::frontend
