// How fast the body has been turning, for Jacobians by calibration states. A Jacobian with the noise of the very
// samples that carry the pose on is correlated with the error it is to explain: in slow motion, where noise is all
// there is, gyro scale and camera-IMU delay would be learnt from it.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class RateHistory {
 public:
  /// At the last sample: the mean over the last hundredth of a second, rad/s.
  static Eigen::Vector3d last(const std::vector<ImuSample>& samples);
  /// Takes what the gyro measured from the last image to this one.
  void add(const std::vector<ImuSample>& samples);
  /// Mean over `samples`, which are not added yet, as the intervals before let expect it, rad/s; their own while there
  /// are too few of those.
  Eigen::Vector3d expected(const std::vector<ImuSample>& samples) const;
  /// Within the last second or so the rate has changed by clearly more than the noise of last(): only then does the way
  /// between images tell when they were taken.
  bool changes() const;

 private:
  /// Mean square of one sample's noise per axis by the samples that are complete now; false without any.
  bool noiseOf(const std::vector<ImuSample>& samples, double* variance);

  std::array<Eigen::Vector3d, 3> means_;  ///< of the last intervals, the newest first, rad/s
  int intervals_ = 0;
  Eigen::Vector3d smoothed_ = Eigen::Vector3d::Zero();
  double squared_changes_ = 0;         ///< per axis, (rad/s)^2
  double noise_ = 0;                   ///< of last(), per axis, (rad/s)^2
  std::array<ImuSample, 2> measured_;  ///< the newest, older first, without those interpolated at images
  int measured_count_ = 0;
};

}  // namespace vip_slam
