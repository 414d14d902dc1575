// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/gyro_range.h"

#include <algorithm>

namespace vip_slam {
namespace {

// rad/s; no gyro has a smaller range (125 degrees per second), and a robot that turns at a steady rate is slower.
constexpr double kMinEnd = 2.0;
// Number of samples at exactly the extreme value that prove saturation: a stream that repeats each value a few times
// has a few of them at its fastest turn.
constexpr int kProof = 10;
constexpr double kSame = 1e-6;  // relative tolerance of equal values
constexpr double kKept = 5.0;   // s

}  // namespace

void GyroRange::add(double t, const Eigen::Vector3d& rate) {
  double cut = 0;
  for (int k = 0; k < 6; ++k) {
    const double value = k < 3 ? rate(k) : -rate(k - 3);
    if (!(value > kMinEnd)) continue;
    Extreme& extreme = extremes_[static_cast<std::size_t>(k)];
    if (value > extreme.value * (1 + kSame)) {
      extreme = {value, 1};
    } else if (value >= extreme.value * (1 - kSame) && ++extreme.count >= kProof) {
      cut = value;
    }
  }
  if (cut == 0) return;
  end_ = cut;
  ++samples_;
  cut_.emplace_back(t, cut);
  while (!cut_.empty() && cut_.front().first < t - kKept) cut_.pop_front();
}

double GyroRange::cutOff(double t0, double t1) const {
  double end = 0;
  for (const auto& [t, value] : cut_) {
    if (t >= t0 && t <= t1) end = std::max(end, value);
  }
  return end;
}

}  // namespace vip_slam
