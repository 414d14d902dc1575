#include "gyro_history.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace vip_slam {
namespace {
constexpr double kSeconds = 5.0;  // more than an image waits for anything
}  // namespace

void GyroHistory::add(double t, const Eigen::Vector3d& gyro) {
  if (!std::isfinite(t) || !gyro.allFinite() || (!samples_.empty() && t <= samples_.back().first)) return;
  samples_.emplace_back(t, gyro);
  while (samples_.front().first < t - kSeconds) samples_.pop_front();
}

Eigen::Vector3d GyroHistory::at(double t) const {
  if (samples_.empty()) return Eigen::Vector3d::Zero();
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t,
                                      [](const auto& sample, double time) { return sample.first < time; });
  if (after == samples_.begin()) return after->second;
  if (after == samples_.end()) return samples_.back().second;
  const auto before = std::prev(after);
  const double share = (t - before->first) / (after->first - before->first);
  return (1 - share) * before->second + share * after->second;
}

}  // namespace vip_slam
