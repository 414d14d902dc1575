// SPDX-License-Identifier: BSD-3-Clause
// IMU preintegration between two keyframes (paper section "IMU and Point Feature Measurement"; Forster 2015, residual
// as in VINS-Mono).
// Gyro and accelerometer are linear over each step, with the terms of coning and sculling that follow from it; J and
// Sigma use the same F.
// Noise is given as Kalibr densities. Residual order and state order: (theta, p, v, b_g, b_a).
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class Preintegration {
 public:
  Preintegration() = default;
  /// Integrates `samples` (>= 2, ascending, first at t_i and last at t_j) about the given biases. Throws
  /// std::invalid_argument when there are fewer, when they are not in order, or when a noise density is zero.
  Preintegration(const std::vector<ImuSample>& samples, const Eigen::Vector3d& bias_gyro,
                 const Eigen::Vector3d& bias_accel, const ImuNoise& noise);

  double dt() const { return dt_; }
  const Eigen::Matrix3d& deltaR() const { return delta_R_; }      ///< R_i_j
  const Eigen::Vector3d& alpha() const { return alpha_; }         ///< position increment, frame i
  const Eigen::Vector3d& beta() const { return beta_; }           ///< velocity increment, frame i
  const Eigen::Vector3d& biasGyro() const { return bias_gyro_; }  ///< linearisation point
  const Eigen::Vector3d& biasAccel() const { return bias_accel_; }
  const Eigen::Matrix3d& J_theta_bg() const { return J_theta_bg_; }
  const Eigen::Matrix3d& J_alpha_bg() const { return J_alpha_bg_; }
  const Eigen::Matrix3d& J_alpha_ba() const { return J_alpha_ba_; }
  const Eigen::Matrix3d& J_beta_bg() const { return J_beta_bg_; }
  const Eigen::Matrix3d& J_beta_ba() const { return J_beta_ba_; }
  /// 15x15 covariance of the residual (theta, p, v, b_g, b_a).
  const Matrix15d& covariance() const { return covariance_; }
  /// Upper-triangular W with W^T W = covariance^-1 (computed once).
  const Matrix15d& sqrtInformation() const { return sqrt_information_; }

  /// True when the biases have changed so much that reintegration pays (|db_g| > 0.01 rad/s or |db_a| > 0.1 m/s^2).
  bool needsReintegration(const Eigen::Vector3d& bias_gyro, const Eigen::Vector3d& bias_accel) const;

  /// State j predicted from state i (biases copied). G = (0,0,g).
  NavState predict(const NavState& state_i, const Eigen::Vector3d& G) const;

  /// Whitened or raw residual (order theta, p, v, b_g, b_a) and optional 15x15 Jacobians with respect to the
  /// perturbations of states i and j (same order). `whiten` multiplies all by sqrtInformation().
  Eigen::Matrix<double, 15, 1> residual(const NavState& i, const NavState& j, const Eigen::Vector3d& G,
                                        Matrix15d* J_i = nullptr, Matrix15d* J_j = nullptr, bool whiten = true) const;

 private:
  double dt_ = 0;
  Eigen::Vector3d bias_gyro_ = Eigen::Vector3d::Zero(), bias_accel_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d delta_R_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d alpha_ = Eigen::Vector3d::Zero(), beta_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d J_theta_bg_, J_alpha_bg_, J_alpha_ba_, J_beta_bg_, J_beta_ba_;
  Matrix15d covariance_, sqrt_information_;
};

}  // namespace vip_slam
