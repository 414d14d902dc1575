// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/gyro_correction.h"

namespace vip_slam {

std::vector<ImuSample> withGyroCorrection(std::vector<ImuSample> samples, const Eigen::Matrix3d& correction) {
  for (ImuSample& sample : samples) sample.gyro = correctedRate(sample.gyro, correction);
  return samples;
}

}  // namespace vip_slam
