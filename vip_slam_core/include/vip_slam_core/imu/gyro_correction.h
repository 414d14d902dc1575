// SPDX-License-Identifier: BSD-3-Clause
// A gyro's scale errors and axis misalignment, which are not white noise: a correction C with
// omega = (I + C) * measured, applied before the bias is removed. Scale errors are on its diagonal (-0.003: measures
// 0.3 % too much), cross-axis sensitivities (radians) off the diagonal.
#pragma once

#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

inline Eigen::Vector3d correctedRate(const Eigen::Vector3d& measured, const Eigen::Matrix3d& correction) {
  return measured + correction * measured;
}

/// `samples` with corrected rates.
std::vector<ImuSample> withGyroCorrection(std::vector<ImuSample> samples, const Eigen::Matrix3d& correction);

}  // namespace vip_slam
