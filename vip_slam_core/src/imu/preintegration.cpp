// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/preintegration.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>

namespace vip_slam {
namespace {

constexpr int kTheta = 0, kP = 3, kV = 6, kBg = 9, kBa = 12;

// Gamma_2(phi) = int_0^1 int_0^s Exp(u phi) du ds = I/2 + (x - sin x)/x^3 [phi] + (x^2/2 + cos x - 1)/x^4 [phi]^2.
Eigen::Matrix3d doubleIntegralOfExp(const Eigen::Vector3d& phi) {
  const double y = phi.squaredNorm();
  double c1, c2;
  if (y < 0.09) {  // the quotients cancel
    c1 = 1.0 / 6 - y * (1.0 / 120 - y * (1.0 / 5040 - y / 362880.0));
    c2 = 1.0 / 24 - y * (1.0 / 720 - y * (1.0 / 40320 - y / 3628800.0));
  } else {
    const double x = std::sqrt(y);
    c1 = (x - std::sin(x)) / (x * y);
    c2 = (0.5 * y + std::cos(x) - 1.0) / (y * y);
  }
  const Eigen::Matrix3d W = hat(phi);
  return 0.5 * Eigen::Matrix3d::Identity() + c1 * W + c2 * W * W;
}

// One step's increments in the frame of its first sample, and their derivatives by the biases.
struct Step {
  double dt;
  Eigen::Vector3d phi, velocity, position;
  Eigen::Matrix3d phi_bg, velocity_bg, velocity_ba, position_bg, position_ba;
};

// Angular rate and specific force are taken as linear between the samples. With the mid sample held constant the
// integrals of Exp(w t) a have closed forms; the linear change (da, dw) adds the coning term dt^2/12 w0 x w1 in
// rotation, dt^2/12 (w x da - dw x a) in velocity, and -dt^2/12 da - dt^3/24 dw x a in position.
Step integrateStep(const ImuSample& first, const ImuSample& second, const Eigen::Vector3d& bias_gyro,
                   const Eigen::Vector3d& bias_accel) {
  Step step;
  const double dt = step.dt = second.t - first.t;
  const double c = dt * dt / 12.0;
  const Eigen::Vector3d w0 = first.gyro - bias_gyro, w1 = second.gyro - bias_gyro;
  const Eigen::Vector3d w = 0.5 * (w0 + w1);
  const Eigen::Vector3d a = 0.5 * (first.accel + second.accel) - bias_accel;
  const Eigen::Vector3d da = second.accel - first.accel, dw = second.gyro - first.gyro;

  step.phi = w * dt + c * w0.cross(w1);
  step.phi_bg = -dt * Eigen::Matrix3d::Identity() + c * hat(dw);

  const Eigen::Matrix3d single = leftJacobianSO3(step.phi);
  const Eigen::Matrix3d twice = doubleIntegralOfExp(step.phi);
  step.velocity = dt * (single * a) + c * (w.cross(da) - dw.cross(a));
  step.position = dt * dt * (twice * a) - c * da - 0.5 * dt * c * dw.cross(a);
  step.velocity_ba = -dt * single + c * hat(dw);
  step.position_ba = -dt * dt * twice + 0.5 * dt * c * hat(dw);

  // Derivatives of single * a and twice * a by phi, to second order in the (small) angle of one step.
  const Eigen::Matrix3d A = hat(a);
  const Eigen::Matrix3d second_order = hat(step.phi.cross(a)) + hat(step.phi) * A;
  step.velocity_bg = dt * (-A / 2.0 - second_order / 6.0) * step.phi_bg + c * hat(da);
  step.position_bg = dt * dt * (-A / 6.0 - second_order / 24.0) * step.phi_bg;
  return step;
}

// In one step velocity and position have the same noise vector, so the covariance of a single step is singular. Between
// two images within an IMU gap there is only one step: split it in two, which is the same motion.
std::vector<ImuSample> halved(const std::vector<ImuSample>& step) {
  ImuSample middle;
  middle.t = 0.5 * (step[0].t + step[1].t);
  middle.gyro = 0.5 * (step[0].gyro + step[1].gyro);
  middle.accel = 0.5 * (step[0].accel + step[1].accel);
  return {step[0], middle, step[1]};
}

// Upper-triangular W with W^T W = covariance^-1: Cholesky of the reversed matrix, so nothing is inverted twice.
Matrix15d sqrtInformationOf(const Matrix15d& covariance) {
  const Matrix15d reversed = covariance.reverse();
  const Eigen::LLT<Matrix15d> llt(reversed);
  if (llt.info() != Eigen::Success) {
    throw std::invalid_argument("preintegration: covariance is not positive definite, expected noise densities > 0");
  }
  const Matrix15d inverse = llt.matrixL().solve(Matrix15d::Identity());
  return inverse.reverse();
}

}  // namespace

Preintegration::Preintegration(const std::vector<ImuSample>& given, const Eigen::Vector3d& bias_gyro,
                               const Eigen::Vector3d& bias_accel, const ImuNoise& noise)
    : bias_gyro_(bias_gyro), bias_accel_(bias_accel) {
  if (given.size() < 2) {
    throw std::invalid_argument("preintegration: " + std::to_string(given.size()) + " samples, expected at least 2");
  }
  std::vector<ImuSample> halves;
  if (given.size() == 2) halves = halved(given);
  const std::vector<ImuSample>& samples = halves.empty() ? given : halves;
  // One matrix carries the bias Jacobians (its columns b_g, b_a) and propagates the covariance.
  Matrix15d J = Matrix15d::Identity();
  covariance_.setZero();
  for (std::size_t k = 1; k < samples.size(); ++k) {
    if (!(samples[k].t > samples[k - 1].t)) {
      throw std::invalid_argument("preintegration: sample " + std::to_string(k) +
                                  " does not follow its predecessor, expected ascending times");
    }
    const Step step = integrateStep(samples[k - 1], samples[k], bias_gyro_, bias_accel_);
    const double dt = step.dt;
    const Eigen::Matrix3d Jr = rightJacobianSO3(step.phi);
    const Eigen::Matrix3d step_R = expSO3(step.phi);

    Matrix15d F = Matrix15d::Identity();
    F.block<3, 3>(kTheta, kTheta) = step_R.transpose();
    F.block<3, 3>(kTheta, kBg) = Jr * step.phi_bg;
    F.block<3, 3>(kP, kTheta) = -delta_R_ * hat(step.position);
    F.block<3, 3>(kP, kV) = dt * Eigen::Matrix3d::Identity();
    F.block<3, 3>(kP, kBg) = delta_R_ * step.position_bg;
    F.block<3, 3>(kP, kBa) = delta_R_ * step.position_ba;
    F.block<3, 3>(kV, kTheta) = -delta_R_ * hat(step.velocity);
    F.block<3, 3>(kV, kBg) = delta_R_ * step.velocity_bg;
    F.block<3, 3>(kV, kBa) = delta_R_ * step.velocity_ba;

    // White noise acts like a bias of this step alone, with variance sigma^2/dt. The random walk adds sigma_w^2 dt.
    const Eigen::Matrix<double, 9, 3> by_gyro = F.block<9, 3>(0, kBg), by_accel = F.block<9, 3>(0, kBa);
    covariance_ = (F * covariance_ * F.transpose()).eval();
    covariance_.topLeftCorner<9, 9>() +=
        (noise.gyro_noise_density * noise.gyro_noise_density / dt) * by_gyro * by_gyro.transpose() +
        (noise.accel_noise_density * noise.accel_noise_density / dt) * by_accel * by_accel.transpose();
    covariance_.diagonal().segment<3>(kBg).array() += noise.gyro_random_walk * noise.gyro_random_walk * dt;
    covariance_.diagonal().segment<3>(kBa).array() += noise.accel_random_walk * noise.accel_random_walk * dt;
    J = (F * J).eval();

    alpha_ += beta_ * dt + delta_R_ * step.position;
    beta_ += delta_R_ * step.velocity;
    delta_R_ = delta_R_ * step_R;
    dt_ += dt;
  }
  delta_R_ = Eigen::Quaterniond(delta_R_).normalized().toRotationMatrix();
  J_theta_bg_ = J.block<3, 3>(kTheta, kBg);
  J_alpha_bg_ = J.block<3, 3>(kP, kBg);
  J_alpha_ba_ = J.block<3, 3>(kP, kBa);
  J_beta_bg_ = J.block<3, 3>(kV, kBg);
  J_beta_ba_ = J.block<3, 3>(kV, kBa);
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  sqrt_information_ = sqrtInformationOf(covariance_);
}

bool Preintegration::needsReintegration(const Eigen::Vector3d& bias_gyro, const Eigen::Vector3d& bias_accel) const {
  return (bias_gyro - bias_gyro_).norm() > 0.01 || (bias_accel - bias_accel_).norm() > 0.1;
}

NavState Preintegration::predict(const NavState& state_i, const Eigen::Vector3d& G) const {
  const Eigen::Vector3d dbg = state_i.bias_gyro - bias_gyro_, dba = state_i.bias_accel - bias_accel_;
  const Eigen::Quaterniond& R_i = state_i.T_W_I.rotation();
  NavState state_j = state_i;
  state_j.t = state_i.t + dt_;
  const Eigen::Quaterniond delta = Eigen::Quaterniond(delta_R_) * expQuaternion(J_theta_bg_ * dbg);
  const Eigen::Vector3d alpha = alpha_ + J_alpha_bg_ * dbg + J_alpha_ba_ * dba;
  const Eigen::Vector3d beta = beta_ + J_beta_bg_ * dbg + J_beta_ba_ * dba;
  state_j.T_W_I = SE3(R_i * delta, state_i.T_W_I.t() + state_i.v_W * dt_ - 0.5 * G * dt_ * dt_ + R_i * alpha);
  state_j.v_W = state_i.v_W - G * dt_ + R_i * beta;
  return state_j;
}

Eigen::Matrix<double, 15, 1> Preintegration::residual(const NavState& i, const NavState& j, const Eigen::Vector3d& G,
                                                      Matrix15d* J_i, Matrix15d* J_j, bool whiten) const {
  const Eigen::Vector3d dbg = i.bias_gyro - bias_gyro_, dba = i.bias_accel - bias_accel_;
  const Eigen::Matrix3d R_i_T = i.T_W_I.rotation().conjugate().toRotationMatrix();
  const Eigen::Vector3d position = R_i_T * (j.T_W_I.t() - i.T_W_I.t() - i.v_W * dt_ + 0.5 * G * dt_ * dt_);
  const Eigen::Vector3d velocity = R_i_T * (j.v_W - i.v_W + G * dt_);
  const Eigen::Quaterniond R_i_j = i.T_W_I.rotation().conjugate() * j.T_W_I.rotation();
  const Eigen::Vector3d correction = J_theta_bg_ * dbg;
  const Eigen::Quaterniond predicted = Eigen::Quaterniond(delta_R_) * expQuaternion(correction);

  Eigen::Matrix<double, 15, 1> r;
  const Eigen::Vector3d r_theta = logSO3(predicted.conjugate() * R_i_j);
  r.segment<3>(kTheta) = r_theta;
  r.segment<3>(kP) = position - (alpha_ + J_alpha_bg_ * dbg + J_alpha_ba_ * dba);
  r.segment<3>(kV) = velocity - (beta_ + J_beta_bg_ * dbg + J_beta_ba_ * dba);
  r.segment<3>(kBg) = j.bias_gyro - i.bias_gyro;
  r.segment<3>(kBa) = j.bias_accel - i.bias_accel;

  // Right perturbation on R, additive on p, v and biases; each block is checked numerically in test_preintegration.
  const Eigen::Matrix3d I3 = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d Jr_inv = rightJacobianInverseSO3(r_theta);
  if (J_i) {
    J_i->setZero();
    J_i->block<3, 3>(kTheta, kTheta) = -Jr_inv * R_i_j.conjugate().toRotationMatrix();
    J_i->block<3, 3>(kTheta, kBg) = -Jr_inv * expSO3(-r_theta) * rightJacobianSO3(correction) * J_theta_bg_;
    J_i->block<3, 3>(kP, kTheta) = hat(position);
    J_i->block<3, 3>(kP, kP) = -R_i_T;
    J_i->block<3, 3>(kP, kV) = -R_i_T * dt_;
    J_i->block<3, 3>(kP, kBg) = -J_alpha_bg_;
    J_i->block<3, 3>(kP, kBa) = -J_alpha_ba_;
    J_i->block<3, 3>(kV, kTheta) = hat(velocity);
    J_i->block<3, 3>(kV, kV) = -R_i_T;
    J_i->block<3, 3>(kV, kBg) = -J_beta_bg_;
    J_i->block<3, 3>(kV, kBa) = -J_beta_ba_;
    J_i->block<3, 3>(kBg, kBg) = -I3;
    J_i->block<3, 3>(kBa, kBa) = -I3;
    if (whiten) *J_i = (sqrt_information_ * *J_i).eval();
  }
  if (J_j) {
    J_j->setZero();
    J_j->block<3, 3>(kTheta, kTheta) = Jr_inv;
    J_j->block<3, 3>(kP, kP) = R_i_T;
    J_j->block<3, 3>(kV, kV) = R_i_T;
    J_j->block<3, 3>(kBg, kBg) = I3;
    J_j->block<3, 3>(kBa, kBa) = I3;
    if (whiten) *J_j = (sqrt_information_ * *J_j).eval();
  }
  if (whiten) r = (sqrt_information_ * r).eval();
  return r;
}

}  // namespace vip_slam
