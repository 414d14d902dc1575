// SPDX-License-Identifier: BSD-3-Clause
// Synthesises the measurements of an IMU that moves along a trajectory.
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_sim/motion/spline_trajectory.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

struct ImuBias {
  Eigen::Vector3d gyro, accel;
};

struct ImuLog {
  std::vector<ImuSample> samples;  ///< times relative to the trajectory's begin = 0
  std::vector<ImuBias> biases;     ///< the true bias of each sample
};

/// Samples at k / rate over the whole trajectory. White noise sigma = density * sqrt(rate); biases walk with
/// sigma = walk / sqrt(rate) per sample, from initial values of one sigma each. `gravity` in m/s^2.
ImuLog synthesiseImu(const SplineTrajectory& trajectory, const ImuOptions& options, int seed, double gravity = 9.81);

}  // namespace vip_slam
