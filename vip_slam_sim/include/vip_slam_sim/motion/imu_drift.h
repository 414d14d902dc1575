// SPDX-License-Identifier: BSD-3-Clause
// What an IMU measures beyond a constant bias: a bias that comes with warming up, and a gyro that feels acceleration.
#pragma once

#include <Eigen/Core>

#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

/// Bias that grows from zero towards a final value as the sensor warms up.
class ThermalDrift {
 public:
  ThermalDrift(const ImuOptions& options, int seed);
  Eigen::Vector3d gyro(double t) const { return gyro_ * grown(t); }
  Eigen::Vector3d accel(double t) const { return accel_ * grown(t); }

 private:
  double grown(double t) const;

  double warm_up_;
  Eigen::Vector3d gyro_, accel_;
};

/// What the gyro measures of specific force.
class GSensitivity {
 public:
  GSensitivity(const ImuOptions& options, int seed);
  Eigen::Vector3d operator()(const Eigen::Vector3d& force) const { return matrix_ * force; }

 private:
  Eigen::Matrix3d matrix_;
};

}  // namespace vip_slam
