// SPDX-License-Identifier: BSD-3-Clause
// IMU propagation between two images: predicted state, transition Phi and noise Q, state order (theta, p, v, b_g, b_a).
// Phi is evaluated between the first estimates of both ends (FEJ), which keeps the four unobservable directions
// (position and yaw) unobservable: Phi N_k = N_{k+1} exactly.
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

/// By how much the window's motion may be wrong that an IMU gave before it was found to be at fault, in one sigma of
/// its sum.
struct RefutedMotion {
  double seconds = 0;                 ///< up to the newest clone
  double turn = 0, displacement = 0;  ///< rad, m, along each axis
};

struct Propagation {
  NavState predicted;
  Matrix15d Phi = Matrix15d::Identity();
  /// Jacobian of the predicted state with respect to the nine entries of the gyro's correction, column by column.
  Eigen::Matrix<double, 15, 9> Phi_gyro = Eigen::Matrix<double, 15, 9>::Zero();
  Matrix15d Q = Matrix15d::Identity();
  /// Whitening of the noise: lower triangular W with W^T W = Q^-1.
  Matrix15d W = Matrix15d::Identity();
  /// One sigma, along the least certain axis, of the displacement since the newest clone, m; `P` is the covariance of
  /// the state there.
  double displacementSigma(const Matrix15d& P) const;
  Eigen::Matrix3d displacementCovariance(const Matrix15d& P) const;  ///< of the displacement, world axes, m^2
  Eigen::Matrix3d turnCovariance(const Matrix15d& P) const;          ///< of the rotation, axes at the end, rad^2
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();                 ///< bias-corrected rate at the end
  bool inertial = true;  ///< by the IMU, not by what images and depth saw of the motion
  bool open =
      false;  ///< a stand-in took the IMU's place over this interval alone: the motion before and after is measured
  RefutedMotion refuted;  ///< of an open one: what the IMU gave before
  RateHistory rates;      ///< the window's, extended to the end
  /// Adds gapCovariance() to Q.
  void admitGap(double gap, double dt);
  /// Adds to Q a rotation at an unmeasured rate of one sigma `rate`, rad/s, for `dt` seconds.
  void admitRate(double rate, double dt);
};

/// Covariance of what linear interpolation between two samples that are `gap` seconds apart errs within `dt` seconds,
/// all of which may lie in the gap.
Matrix15d gapCovariance(double gap, double dt);

/// Integrates `samples` (first at the newest clone's time, last at the new image's) from the newest clone.
/// The window is not changed.
Propagation propagate(const WindowState& window, const std::vector<ImuSample>& samples, const ImuNoise& noise,
                      const Eigen::Vector3d& G);

/// The body's motion since the newest clone as another source than the IMU saw it, for `dt` seconds: T_I0_I1, and its
/// covariance (theta in the axes at the end, p in those at the beginning). The velocity becomes the mean one over the
/// interval; of the biases `noise` gives the walk. The velocity before has no influence.
Propagation propagateByMotion(const WindowState& window, const SE3& T_I0_I1, const Matrix6d& covariance, double dt,
                              const ImuNoise& noise);

}  // namespace vip_slam
