// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/motion/imu_drift.h"

#include <cmath>

#include "vip_slam_sim/rng.h"

namespace vip_slam {

ThermalDrift::ThermalDrift(const ImuOptions& options, int seed) : warm_up_(options.warm_up) {
  Rng rng(static_cast<std::uint64_t>(seed) * 4201 + 7);
  for (int k = 0; k < 3; ++k) {
    gyro_[k] = options.gyro_drift * rng.gauss();
    accel_[k] = options.accel_drift * rng.gauss();
  }
}

double ThermalDrift::grown(double t) const { return 1 - std::exp(-t / warm_up_); }

GSensitivity::GSensitivity(const ImuOptions& options, int seed) {
  Rng rng(static_cast<std::uint64_t>(seed) * 4211 + 9);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) matrix_(i, k) = options.g_sensitivity * rng.gauss();
}

}  // namespace vip_slam
