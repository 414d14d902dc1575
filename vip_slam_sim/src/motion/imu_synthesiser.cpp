#include "vip_slam_sim/motion/imu_synthesiser.h"

#include <cmath>

#include "vip_slam_sim/rng.h"

namespace vip_slam {

ImuLog synthesiseImu(const SplineTrajectory& trajectory, const ImuOptions& o, int seed, double gravity) {
  Rng rng(static_cast<std::uint64_t>(seed) * 7919 + 101);
  const auto deviate = [&](double sigma) {
    const double x = rng.gauss(), y = rng.gauss(), z = rng.gauss();
    return Eigen::Vector3d(sigma * x, sigma * y, sigma * z);
  };
  ImuBias bias{deviate(o.gyro_bias), deviate(o.accel_bias)};
  const Eigen::Vector3d scale_gyro = Eigen::Vector3d::Ones() + deviate(o.scale_error);
  const Eigen::Vector3d scale_accel = Eigen::Vector3d::Ones() + deviate(o.scale_error);
  const double root = std::sqrt(o.rate);
  const auto count = static_cast<std::size_t>((trajectory.end() - trajectory.begin()) * o.rate + 1e-6) + 1;
  ImuLog log;
  for (std::size_t k = 0; k < count; ++k) {
    ImuSample s;
    s.t = static_cast<double>(k) / o.rate;
    const MotionState m = trajectory.at(trajectory.begin() + s.t);
    const Eigen::Vector3d force = m.T_W_I.rotation().conjugate() * (m.a_W + gravityVector(gravity));
    s.gyro = scale_gyro.cwiseProduct(m.omega_I) + bias.gyro + deviate(o.gyro_noise_density * root);
    s.accel = scale_accel.cwiseProduct(force) + bias.accel + deviate(o.accel_noise_density * root);
    log.samples.push_back(s);
    log.biases.push_back(bias);
    bias.gyro += deviate(o.gyro_random_walk / root);
    bias.accel += deviate(o.accel_random_walk / root);
  }
  return log;
}

}  // namespace vip_slam
