// SPDX-License-Identifier: BSD-3-Clause
// The inertial side of the front end: what gyroscope and accelerometer measured, and what stands in for a channel that
// there is not, or that is not to be trusted over an interval. A stand-in is a sample like any other, a constant rate
// or specific force, with a noise so wide that it says little: so everything behind (propagation, rolling shutters,
// extrapolation) works alike with and without an IMU. Where the rate comes from is the caller's business; images and
// depth give it (dense_alignment.h, outlier_rejection.h).
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/gyro_range.h"
#include "vip_slam_core/imu/imu_buffer.h"
#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam::frontend {

/// Motion of a hand-held or flying camera as a random process, one sigma, rad/s and m/s^2, and its angular frequency,
/// rad/s.
constexpr double kBodyRate = 2.0, kBodyAcceleration = 6.0, kBodyFrequency = 5.7;

/// Factors on the noise densities of the two channels over an interval.
struct ChannelNoise {
  double gyro = 1, accel = 1;
};

/// Stand-ins over [from, to], IMU clock; a channel without one keeps what was measured.
struct Substitute {
  double from = 0, to = 0;               ///< s
  std::optional<Eigen::Vector3d> gyro;   ///< rad/s, IMU frame, bias included
  std::optional<Eigen::Vector3d> accel;  ///< m/s^2, likewise
};

class InertialInput {
 public:
  InertialInput(const SensorConfig& sensor, double max_gap);

  bool addImu(const ImuSample& sample);
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);

  /// Channels that the sensor has.
  bool hasGyro() const { return has_gyro_; }
  bool hasAccel() const { return has_accel_; }
  bool complete() const { return has_gyro_ && has_accel_; }
  /// Whether the channels that there are have been measured up to `t`; without any: always.
  bool covers(double t) const;
  /// Stamps between which samples are to be had; without a complete IMU everywhere, by substitutes.
  double oldest() const;
  double newest() const;
  /// Stamp of the last measured sample; minus infinity when there is none.
  double newestMeasured() const;

  /// Samples in [t0, t1], first and last at exactly t0 and t1. Empty when t1 <= t0, and when an IMU that is complete
  /// does not cover them and no substitute does. `max_gap` receives the largest step between measured samples.
  std::vector<ImuSample> between(double t0, double t1, double* max_gap = nullptr) const;
  std::optional<ImuSample> at(double t) const;

  void substitute(const Substitute& substitute);
  /// Noise of the samples in [t0, t1], as factors on the configured densities.
  ChannelNoise noise(double t0, double t1) const;
  /// Whether both channels were measured, and believed, all over [t0, t1].
  bool measured(double t0, double t1) const;

  void dropBefore(double t);
  /// Forgets all samples; what is known of the gyro's range stays.
  void clear();

  const ImuBufferCounters& counters() const { return buffer_.counters(); }
  const GyroRange& range() const { return range_; }

 private:
  struct Single {
    double t;
    Eigen::Vector3d value;
  };
  /// Value of a lone channel at t; that of the nearest sample outside.
  Eigen::Vector3d lone(double t) const;
  std::vector<ImuSample> measuredBetween(double t0, double t1, double* max_gap) const;

  bool has_gyro_, has_accel_;
  double gyro_density_, accel_density_;
  Eigen::Matrix3d gyro_correction_;
  double gravity_;
  ImuBuffer buffer_;
  std::deque<Single> lone_;  ///< of the only channel that there is
  GyroRange range_;
  std::deque<Substitute> substitutes_;
};

}  // namespace vip_slam::frontend
