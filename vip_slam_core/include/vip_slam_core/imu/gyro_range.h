// SPDX-License-Identifier: BSD-3-Clause
// Detects saturation: a gyro at the limit of its range repeats the same number while the body turns faster.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <utility>

#include <Eigen/Core>

namespace vip_slam {

class GyroRange {
 public:
  /// Adds a raw measurement, rad/s.
  void add(double t, const Eigen::Vector3d& rate);
  /// The limit of the range, rad/s, when recent samples between t0 and t1 were saturated; else 0.
  double cutOff(double t0, double t1) const;
  /// For a clock that may run back; the limit of the range stays known.
  void forgetTimes() { cut_.clear(); }
  std::uint64_t samples() const { return samples_; }  ///< total number of saturated samples
  double end() const { return end_; }                 ///< limit of the range, rad/s, as last seen; 0: never reached

 private:
  struct Extreme {
    double value = 0;
    int count = 0;  ///< number of samples with exactly this value
  };
  std::array<Extreme, 6> extremes_;  ///< maximum and minimum of each axis
  std::deque<std::pair<double, double>> cut_;
  std::uint64_t samples_ = 0;
  double end_ = 0;
};

}  // namespace vip_slam
