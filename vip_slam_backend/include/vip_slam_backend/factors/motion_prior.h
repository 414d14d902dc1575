// SPDX-License-Identifier: BSD-3-Clause
// A weak prior (not in the paper) on velocity and biases of one keyframe without an IMU factor from the keyframe before
// (first keyframe, IMU gap).
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

struct MotionPrior {
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero(), bias_gyro = Eigen::Vector3d::Zero(),
                  bias_accel = Eigen::Vector3d::Zero();
  double sigma_v = 1.0, sigma_bg = 0.01, sigma_ba = 0.1;  ///< m/s, rad/s, m/s^2
};

/// Residual (v, b_g, b_a), whitened; the Jacobian is the diagonal of motionPriorWeights().
inline Eigen::Matrix<double, 9, 1> motionPriorResidual(const MotionPrior& prior, const NavState& state) {
  Eigen::Matrix<double, 9, 1> r;
  r << (state.v_W - prior.v_W) / prior.sigma_v, (state.bias_gyro - prior.bias_gyro) / prior.sigma_bg,
      (state.bias_accel - prior.bias_accel) / prior.sigma_ba;
  return r;
}

inline Eigen::Matrix<double, 9, 1> motionPriorWeights(const MotionPrior& prior) {
  Eigen::Matrix<double, 9, 1> w;
  w << Eigen::Vector3d::Constant(1 / prior.sigma_v), Eigen::Vector3d::Constant(1 / prior.sigma_bg),
      Eigen::Vector3d::Constant(1 / prior.sigma_ba);
  return w;
}

}  // namespace vip_slam
