// SPDX-License-Identifier: BSD-3-Clause
// Time-ordered IMU samples with boundary interpolation. Joins separate gyro and accelerometer streams, and replaces
// single wrong samples (spike_filter.h): a suspicious sample enters the buffer only with the next one.
// Not thread-safe: one owner; callers lock around it.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/imu/spike_filter.h"

namespace vip_slam {

struct ImuBufferCounters {
  std::size_t accepted = 0, out_of_order = 0, duplicate = 0, gaps = 0;
  std::size_t not_finite = 0;  ///< or all zero
  std::size_t spikes = 0;      ///< samples replaced by interpolation between their neighbours
};

class ImuBuffer {
 public:
  /// `gap_seconds`: a distance between samples above this counts as a gap. `capacity_seconds` bounds memory.
  explicit ImuBuffer(double gap_seconds = 0.05, double capacity_seconds = 30.0);

  /// False (and counted) when the sample is not finite, all zero (a failing bus), or repeats or precedes the newest
  /// stamp.
  bool add(const ImuSample& sample);
  /// Split streams: the accelerometer is interpolated to the gyro stamps; samples are available once both streams cover
  /// them. False likewise; zeros are refused of the accelerometer only, since a gyro at rest may read them.
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);

  bool empty() const { return samples_.empty(); }
  std::size_t size() const { return samples_.size(); }
  double oldest() const { return samples_.front().t; }
  double newest() const { return samples_.back().t; }
  bool covers(double t) const { return !empty() && oldest() <= t && t <= newest(); }

  /// Samples in [t0, t1], first and last interpolated to exactly t0 and t1. Empty when the buffer does not cover both
  /// or t1 <= t0. `max_gap`, when given, receives the largest step inside.
  std::vector<ImuSample> between(double t0, double t1, double* max_gap = nullptr) const;
  /// The sample interpolated at t, when covered.
  std::optional<ImuSample> at(double t) const;

  /// Forgets samples older than t, keeping one before it for interpolation.
  void dropBefore(double t);
  void clear();
  const ImuBufferCounters& counters() const { return counters_; }

 private:
  struct Stamped {
    double t;
    Eigen::Vector3d value;
  };
  /// Whether a sample may be added; counts the reason otherwise.
  bool acceptable(double t, bool finite, const SpikeFilter& stream);
  void countReplaced();
  void append(const ImuSample& sample);
  void joinStreams();

  double gap_seconds_, capacity_seconds_;
  std::deque<ImuSample> samples_;
  std::deque<Stamped> gyro_, accel_;
  // Split streams are filtered before they are joined: interpolation would spread a spike over its neighbours.
  SpikeFilter united_, gyro_stream_, accel_stream_;
  ImuBufferCounters counters_;
};

/// Linear interpolation of two samples at t.
ImuSample interpolate(const ImuSample& a, const ImuSample& b, double t);

}  // namespace vip_slam
