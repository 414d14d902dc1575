// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/stream_time/least_delay.h"

#include <algorithm>

namespace vip_slam {
namespace {

constexpr double kSteady = 0.03;          // s within which the least delay of each second stays
constexpr std::size_t kSecondsKept = 60;  // seconds in which it is looked for
constexpr std::size_t kSecondsKnown = 3;  // seconds after which it is known

}  // namespace

void LeastDelay::add(double stamp, double arrival) {
  if (ahead_.empty() || arrival - second_ >= 1 || arrival < second_) {
    second_ = arrival;
    ahead_.push_back(stamp - arrival);
    if (ahead_.size() > kSecondsKept) ahead_.pop_front();
  }
  ahead_.back() = std::max(ahead_.back(), stamp - arrival);
}

void LeastDelay::clear() { ahead_.clear(); }

std::optional<double> LeastDelay::excess(double stamp, double arrival) const {
  if (ahead_.size() <= kSecondsKnown) return std::nullopt;
  // Played at another rate, or on a machine that is too busy, arrival does not tell. The last second is not over yet.
  const auto [low, high] = std::minmax_element(ahead_.end() - 1 - std::ptrdiff_t(kSecondsKnown), ahead_.end() - 1);
  if (*high - *low > kSteady) return std::nullopt;
  return stamp - arrival - *std::max_element(ahead_.begin(), ahead_.end());
}

}  // namespace vip_slam
