#include "vip_slam_frontend/filter/propagation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"

namespace vip_slam {

namespace {

// Added to Q's diagonal so that its factor exists for intervals of a few microseconds. (rad, m, m/s, rad/s, m/s^2)
Eigen::Matrix<double, 15, 1> noiseFloor() {
  Eigen::Matrix<double, 15, 1> floor;
  floor << Eigen::Vector3d::Constant(1e-7), Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-6),
      Eigen::Vector3d::Constant(1e-8), Eigen::Vector3d::Constant(1e-7);
  return floor;
}

// Motion of a hand-held camera, one sigma, rad/s and m/s^2, at one to two hertz. Linear interpolation across a gap is
// wrong by curvature * gap^2 (1/s^3 and m/s^4), up to the full amplitude.
constexpr double kRate = 2.0, kRateCurvature = 8.0, kAcceleration = 6.0, kAccelerationCurvature = 24.0;

Matrix15d whitening(const Matrix15d& Q) {
  const Eigen::LLT<Matrix15d> llt(Q);
  return llt.matrixL().solve(Matrix15d::Identity());
}

}  // namespace

void Propagation::admitGap(double gap, double dt) {
  const double rate = std::min(kRate, kRateCurvature * gap * gap);
  const double acceleration = std::min(kAcceleration, kAccelerationCurvature * gap * gap);
  // The error is constant over the whole interval.
  const double theta = rate * dt, v = acceleration * dt, p = 0.5 * v * dt;
  for (int axis = 0; axis < 3; ++axis) {
    Q(axis, axis) += theta * theta;
    Q(3 + axis, 3 + axis) += p * p;
    Q(6 + axis, 6 + axis) += v * v;
    Q(3 + axis, 6 + axis) += p * v;
    Q(6 + axis, 3 + axis) += p * v;
  }
  W = whitening(Q);
}

void Propagation::admitRate(double rate, double dt) {
  Q.diagonal().head<3>().array() += std::pow(rate * dt, 2);
  W = whitening(Q);
}

void Propagation::admitStep(double dv, double dt) {
  // At s after the first image, s uniform: dp = dv (dt - s), so E[dp^2] = dv^2 dt^2 / 3 and E[dp dv] = dv^2 dt / 2.
  const double variance = dv * dv;
  for (int axis = 0; axis < 3; ++axis) {
    Q(3 + axis, 3 + axis) += variance * dt * dt / 3.0;
    Q(6 + axis, 6 + axis) += variance;
    Q(3 + axis, 6 + axis) += 0.5 * variance * dt;
    Q(6 + axis, 3 + axis) += 0.5 * variance * dt;
  }
  W = whitening(Q);
  step_admitted = true;
}

double Propagation::displacementSigma(const Matrix15d& P) const {
  Eigen::Matrix<double, 3, 15> J = Phi.middleRows<3>(3);
  J.middleCols<3>(3).setZero();  // the position's own error is the same at both ends
  const Eigen::Matrix3d covariance = J * P * J.transpose() + Q.block<3, 3>(3, 3);
  return std::sqrt(std::max(0.0, covariance.diagonal().maxCoeff()));
}

Propagation propagate(const WindowState& window, const std::vector<ImuSample>& samples, const ImuNoise& noise,
                      const Eigen::Vector3d& G, double noise_scale, double stamp_sigma) {
  Propagation result;
  ImuNoise scaled = noise;
  scaled.gyro_noise_density *= noise_scale;
  scaled.accel_noise_density *= noise_scale;
  scaled.gyro_random_walk *= noise_scale;
  scaled.accel_random_walk *= noise_scale;
  const Preintegration pre(withGyroCorrection(samples, window.gyro_correction), window.bias_gyro, window.bias_accel,
                           scaled);
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
  if (stamp_sigma > 0) {
    // Jitter of both images' stamps, with the motion at the end of the interval.
    Eigen::Matrix<double, 9, 1> rate;
    rate << result.omega_I, result.predicted.v_W,
        result.predicted.T_W_I.R() * (samples.back().accel - window.bias_accel) - G;
    result.Q.topLeftCorner<9, 9>() += 2.0 * stamp_sigma * stamp_sigma * rate * rate.transpose();
  }
  result.Q.diagonal() += noiseFloor().cwiseAbs2();
  result.W = whitening(result.Q);
  return result;
}

}  // namespace vip_slam
