// SPDX-License-Identifier: BSD-3-Clause
// IMU samples, noise figures and the navigation state shared by front end and back end.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// Standard gravity vector as used in p_j = p_i + v_i dt - 0.5 G dt^2 + R_i alpha (world z up).
inline Eigen::Vector3d gravityVector(double magnitude = 9.81) { return Eigen::Vector3d(0, 0, magnitude); }

struct ImuSample {
  double t = 0;                                     ///< seconds, IMU clock
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< rad/s, IMU frame
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, m/s^2; at rest about +9.81 along up
};

/// Continuous-time noise densities as in Kalibr, and the prior of the gyro's systematic errors.
struct ImuNoise {
  double gyro_noise_density = 1e-3;     ///< rad/s/sqrt(Hz)
  double gyro_random_walk = 1e-5;       ///< rad/s^2/sqrt(Hz)
  double accel_noise_density = 1e-2;    ///< m/s^2/sqrt(Hz)
  double accel_random_walk = 1e-4;      ///< m/s^3/sqrt(Hz)
  double gyro_correction_sigma = 5e-3;  ///< one sigma of each entry, see gyro_correction.h
};

/// Factors on the configured noise, as found on the way.
struct ImuNoiseScale {
  double density = 1;                    ///< on both noise densities
  double gyro_walk = 1, accel_walk = 1;  ///< on the random walks of the biases: they drift
};

inline ImuNoise scaled(const ImuNoise& noise, const ImuNoiseScale& by) {
  return {noise.gyro_noise_density * by.density, noise.gyro_random_walk * by.gyro_walk,
          noise.accel_noise_density * by.density, noise.accel_random_walk * by.accel_walk, noise.gyro_correction_sigma};
}

/// State of the IMU (body) at time t. Tangent order wherever a 15x15 covariance appears:
/// (theta, p, v, b_g, b_a), theta by right perturbation, p and v in the world (odom or map) frame.
struct NavState {
  double t = 0;
  SE3 T_W_I;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d bias_accel = Eigen::Vector3d::Zero();
};

}  // namespace vip_slam
