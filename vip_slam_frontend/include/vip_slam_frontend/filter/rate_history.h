// SPDX-License-Identifier: BSD-3-Clause
// Recent angular rates of the body, for the Jacobians of calibration states. A Jacobian with the noise of the same
// samples that propagate the pose is correlated with the error it has to explain: in slow motion, which is mostly
// noise, gyro scale and camera-IMU delay would be estimated from that noise.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class RateHistory {
 public:
  /// Rate at the last sample: the mean over the last hundredth of a second, rad/s.
  static Eigen::Vector3d last(const std::vector<ImuSample>& samples);
  /// Adds the gyro's samples from the last image to this one.
  void add(const std::vector<ImuSample>& samples);
  /// Mean rate over `samples`, which are not added yet, extrapolated from the intervals before, rad/s; their own mean
  /// while there are fewer than three intervals.
  Eigen::Vector3d expected(const std::vector<ImuSample>& samples) const;
  /// Whether the rate has changed within the last second or so by clearly more than the noise of last(): only then does
  /// the motion between images show the camera-IMU delay.
  bool changes() const;

 private:
  /// Noise variance of one sample per axis, (rad/s)^2; false without any.
  bool noiseOf(const std::vector<ImuSample>& samples, double* variance);

  std::array<Eigen::Vector3d, 3> means_;  ///< mean rates of the last intervals, the newest first, rad/s
  int intervals_ = 0;
  double squared_changes_ = 0;         ///< per axis, (rad/s)^2
  double noise_ = 0;                   ///< variance of last(), per axis, (rad/s)^2
  std::array<ImuSample, 2> measured_;  ///< the two newest samples, older first, without those interpolated at images
  int measured_count_ = 0;
};

}  // namespace vip_slam
