// SPDX-License-Identifier: BSD-3-Clause
// The integrated rotation angle of the gyro as a function of time: for motions so short that rotations are additive.
#pragma once

#include <algorithm>
#include <vector>

#include "vip_slam_bringup/preflight/recording.h"

namespace vip_slam {

/// Integral of the gyro from the first sample, piecewise linear in time.
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<StampedVector>& gyro) {
    for (const StampedVector& s : gyro) {
      if ((!t_.empty() && s.t <= t_.back()) || !s.value.allFinite()) continue;
      sum_.push_back(t_.empty() ? Eigen::Vector3d::Zero()
                                : Eigen::Vector3d(sum_.back() + 0.5 * (s.t - t_.back()) * (s.value + last_)));
      t_.push_back(s.t);
      last_ = s.value;
    }
  }
  bool covers(double t) const { return t_.size() > 1 && t >= t_.front() && t <= t_.back(); }
  Eigen::Vector3d at(double t) const {
    const std::size_t i = std::min<std::size_t>(
        std::max<std::ptrdiff_t>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin(), 1), t_.size() - 1);
    const double s = (t - t_[i - 1]) / (t_[i] - t_[i - 1]);
    return (1 - s) * sum_[i - 1] + s * sum_[i];
  }

 private:
  std::vector<double> t_;
  std::vector<Eigen::Vector3d> sum_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
};

}  // namespace vip_slam
