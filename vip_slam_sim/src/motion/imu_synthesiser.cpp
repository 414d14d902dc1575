// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/motion/imu_synthesiser.h"

#include <cmath>

#include "vip_slam_sim/motion/imu_drift.h"
#include "vip_slam_sim/rng.h"

namespace vip_slam {

ImuLog synthesiseImu(const SplineTrajectory& trajectory, const ImuOptions& o, int seed, double gravity) {
  Rng rng(static_cast<std::uint64_t>(seed) * 7919 + 101);
  const auto deviate = [&](double sigma) {
    const double x = rng.gauss(), y = rng.gauss(), z = rng.gauss();
    return Eigen::Vector3d(sigma * x, sigma * y, sigma * z);
  };
  ImuBias bias{deviate(o.gyro_bias), deviate(o.accel_bias)};
  Eigen::Matrix3d M_gyro = Eigen::Matrix3d::Identity(), M_accel = M_gyro;
  M_gyro.diagonal() += deviate(o.scale_error);
  M_accel.diagonal() += deviate(o.scale_error);
  for (Eigen::Matrix3d* M : {&M_gyro, &M_accel}) {
    if (!(o.misalignment > 0)) break;  // draws no random numbers, so that other sequences stay the same
    const Eigen::Vector3d right = deviate(o.misalignment), left = deviate(o.misalignment);
    *M += (Eigen::Matrix3d() << 0, right.z(), left.y(), left.z(), 0, right.x(), right.y(), left.x(), 0).finished();
  }
  const ThermalDrift drift(o, seed);
  const GSensitivity felt(o, seed);
  const double root = std::sqrt(o.rate);
  const auto count = static_cast<std::size_t>((trajectory.end() - trajectory.begin()) * o.rate + 1e-6) + 1;
  ImuLog log;
  for (std::size_t k = 0; k < count; ++k) {
    ImuSample s;
    s.t = static_cast<double>(k) / o.rate;
    const MotionState m = trajectory.at(trajectory.begin() + s.t);
    const Eigen::Vector3d force = m.T_W_I.rotation().conjugate() * (m.a_W + gravityVector(gravity));
    const ImuBias now{bias.gyro + drift.gyro(s.t), bias.accel + drift.accel(s.t)};
    s.gyro = M_gyro * m.omega_I + felt(force) + now.gyro + deviate(o.gyro_noise_density * root);
    s.accel = M_accel * force + now.accel + deviate(o.accel_noise_density * root);
    log.samples.push_back(s);
    log.biases.push_back(now);
    bias.gyro += deviate(o.gyro_random_walk / root);
    bias.accel += deviate(o.accel_random_walk / root);
  }
  return log;
}

}  // namespace vip_slam
