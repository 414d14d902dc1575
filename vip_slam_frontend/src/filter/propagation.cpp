// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/propagation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_frontend/inertial/inertial_input.h"

namespace vip_slam {

namespace {

// Added to Q's diagonal so that its factor exists for intervals of a few microseconds. (rad, m, m/s, rad/s, m/s^2)
Eigen::Matrix<double, 15, 1> noiseFloor() {
  Eigen::Matrix<double, 15, 1> floor;
  floor << Eigen::Vector3d::Constant(1e-7), Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-6),
      Eigen::Vector3d::Constant(1e-8), Eigen::Vector3d::Constant(1e-7);
  return floor;
}

Matrix15d whitening(const Matrix15d& Q) {
  const Eigen::LLT<Matrix15d> llt(Q);
  return llt.matrixL().solve(Matrix15d::Identity());
}

}  // namespace

Matrix15d gapCovariance(double gap, double dt) {
  Matrix15d Q = Matrix15d::Zero();
  // Linear interpolation is wrong by the motion's curvature, up to the full amplitude.
  const double share = std::min(1.0, std::pow(frontend::kBodyFrequency * gap, 2) / 8.0);
  const double rate = share * frontend::kBodyRate, acceleration = share * frontend::kBodyAcceleration;
  // The error is constant over the whole interval.
  const double theta = rate * dt, v = acceleration * dt, p = 0.5 * v * dt;
  for (int axis = 0; axis < 3; ++axis) {
    Q(axis, axis) += theta * theta;
    Q(3 + axis, 3 + axis) += p * p;
    Q(6 + axis, 6 + axis) += v * v;
    Q(3 + axis, 6 + axis) += p * v;
    Q(6 + axis, 3 + axis) += p * v;
  }
  return Q;
}

void Propagation::admitGap(double gap, double dt) {
  Q += gapCovariance(gap, dt);
  W = whitening(Q);
}

void Propagation::admitRate(double rate, double dt) {
  Q.diagonal().head<3>().array() += std::pow(rate * dt, 2);
  W = whitening(Q);
}

Eigen::Matrix3d Propagation::displacementCovariance(const Matrix15d& P) const {
  Eigen::Matrix<double, 3, 15> J = Phi.middleRows<3>(3);
  J.middleCols<3>(3).setZero();  // the position's own error is the same at both ends
  return J * P * J.transpose() + Q.block<3, 3>(3, 3);
}

double Propagation::displacementSigma(const Matrix15d& P) const {
  return std::sqrt(std::max(0.0, displacementCovariance(P).diagonal().maxCoeff()));
}

Eigen::Matrix3d Propagation::turnCovariance(const Matrix15d& P) const {
  const Eigen::Matrix3d J = Phi.block<3, 3>(0, 9);
  return J * P.block<3, 3>(9, 9) * J.transpose() + Q.block<3, 3>(0, 0);
}

Propagation propagateByMotion(const WindowState& window, const SE3& T_I0_I1, const Matrix6d& covariance, double dt,
                              const ImuNoise& noise) {
  Propagation result;
  result.inertial = false;
  const NavState from = window.nav();
  result.predicted = from;
  result.predicted.t = from.t + dt;
  result.predicted.T_W_I = from.T_W_I * T_I0_I1;
  result.predicted.v_W = (result.predicted.T_W_I.t() - from.T_W_I.t()) / dt;
  result.omega_I = logSO3(T_I0_I1.R()) / dt;
  result.rates = window.rates;

  const Clone& last = window.clones.back();
  const Eigen::Matrix3d R_fej = last.T_W_I_fej.R(), I = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d dp = result.predicted.T_W_I.t() - last.T_W_I_fej.t();
  Matrix15d& Phi = result.Phi;
  Phi.block<3, 3>(0, 0) = result.predicted.T_W_I.R().transpose() * R_fej;
  Phi.block<3, 3>(3, 0) = -hat(dp) * R_fej;
  Phi.block<3, 3>(6, 0) = -hat(dp) * R_fej / dt;
  Phi.block<3, 3>(6, 6).setZero();

  const Eigen::Matrix3d R_W_I0 = from.T_W_I.R();
  Matrix6d turn = Matrix6d::Identity();
  turn.bottomRightCorner<3, 3>() = R_W_I0;
  const Matrix6d pose = turn * covariance * turn.transpose();
  Matrix15d& Q = result.Q;
  Q.setZero();
  Q.topLeftCorner<6, 6>() = pose;
  Q.block<6, 3>(0, 6) = pose.rightCols<3>() / dt;
  Q.block<3, 6>(6, 0) = Q.block<6, 3>(0, 6).transpose();
  // The velocity at the end differs from the mean one by half of what the acceleration adds.
  Q.block<3, 3>(6, 6) =
      pose.bottomRightCorner<3, 3>() / (dt * dt) + std::pow(0.5 * frontend::kBodyAcceleration * dt, 2) * I;
  Q.block<3, 3>(9, 9) = noise.gyro_random_walk * noise.gyro_random_walk * dt * I;
  Q.block<3, 3>(12, 12) = noise.accel_random_walk * noise.accel_random_walk * dt * I;
  Q.diagonal() += noiseFloor().cwiseAbs2();
  result.W = whitening(Q);
  return result;
}

Propagation propagate(const WindowState& window, const std::vector<ImuSample>& samples, const ImuNoise& noise,
                      const Eigen::Vector3d& G) {
  Propagation result;
  const Preintegration pre(withGyroCorrection(samples, window.gyro_correction), window.bias_gyro, window.bias_accel,
                           noise);
  const NavState from = window.nav();
  result.predicted = pre.predict(from, G);
  result.predicted.t = samples.back().t;
  result.omega_I = correctedRate(RateHistory::last(samples), window.gyro_correction) - window.bias_gyro;

  const Clone& last = window.clones.back();
  const Eigen::Matrix3d R_fej = last.T_W_I_fej.R();
  const Eigen::Matrix3d R_now = last.T_W_I.R();
  const double dt = pre.dt();
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Matrix15d& Phi = result.Phi;
  // dtheta' = R'^T R dtheta + J dbg; dp', dv' from the displacement between first estimates, seen from the world.
  Phi.block<3, 3>(0, 0) = result.predicted.T_W_I.R().transpose() * R_fej;
  Phi.block<3, 3>(0, 9) = pre.J_theta_bg();
  const Eigen::Vector3d dp = result.predicted.T_W_I.t() - last.T_W_I_fej.t() - window.v_W_fej * dt + 0.5 * G * dt * dt;
  const Eigen::Vector3d dv = result.predicted.v_W - window.v_W_fej + G * dt;
  Phi.block<3, 3>(3, 0) = -hat(dp) * R_fej;
  Phi.block<3, 3>(3, 6) = I * dt;
  Phi.block<3, 3>(3, 9) = R_now * pre.J_alpha_bg();
  Phi.block<3, 3>(3, 12) = R_now * pre.J_alpha_ba();
  Phi.block<3, 3>(6, 0) = -hat(dv) * R_fej;
  Phi.block<3, 3>(6, 9) = R_now * pre.J_beta_bg();
  Phi.block<3, 3>(6, 12) = R_now * pre.J_beta_ba();

  // The correction acts as a bias proportional to the rate, which hardly changes between two images.
  const Eigen::Vector3d rate = window.rates.expected(samples);
  for (int axis = 0; axis < 3; ++axis) result.Phi_gyro.block<9, 3>(0, 3 * axis) = -rate(axis) * Phi.block<9, 3>(0, 9);
  result.rates = window.rates;
  result.rates.add(samples);

  // The preintegrated position and velocity noise lives in the frame of the first pose.
  Matrix15d T = Matrix15d::Identity();
  T.block<3, 3>(3, 3) = R_now;
  T.block<3, 3>(6, 6) = R_now;
  result.Q = T * pre.covariance() * T.transpose();
  result.Q.diagonal() += noiseFloor().cwiseAbs2();
  result.W = whitening(result.Q);
  return result;
}

}  // namespace vip_slam
