// SPDX-License-Identifier: BSD-3-Clause
// Helpers shared by the simulator's tests.
#pragma once

#include <string>

#include "vip_slam_sim/sequence/sequence_renderer.h"

namespace vip_slam {

inline std::string libraryPath() { return std::string(VIP_SLAM_SIM_SOURCE_DIR) + "/config/sequences.yaml"; }

/// A shipped sequence without IMU errors and image noise.
inline SequenceSpec cleanSequence(const std::string& name) {
  SequenceSpec spec = loadSequence(name, libraryPath());
  spec.imu.gyro_noise_density = spec.imu.accel_noise_density = 0;
  spec.imu.gyro_random_walk = spec.imu.accel_random_walk = 0;
  spec.imu.gyro_bias = spec.imu.accel_bias = 0;
  spec.effects.read_noise = spec.effects.shot_noise = 0;
  spec.effects.exposure_drift = 0;
  spec.effects.vignetting = 0;
  spec.effects.motion_blur = false;
  return spec;
}

/// Quick to build: coarse light.
inline RenderOptions quickOptions(int first = 0, int count = -1) {
  RenderOptions options;
  options.threads = 2;
  options.light_spacing_scale = 3;
  options.first = first;
  options.count = count;
  return options;
}

}  // namespace vip_slam
