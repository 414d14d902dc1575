// SPDX-License-Identifier: BSD-3-Clause
// Selects the stamps of a trajectory when the clock runs back: a looping bag, joined recordings, a device whose clock
// restarts. A trajectory has each time only once, so for repeated times the first pass is used.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace vip_slam {

class TimePasses {
 public:
  /// Whether the next stamp, s, belongs into the trajectory.
  bool take(double t) {
    if (t == newest_) return false;
    if (t < newest_) {
      if (begin_ <= end_) passes_.emplace_back(begin_, end_);
      begin_ = kNever;
      end_ = -kNever;
    }
    newest_ = t;
    const bool covered = std::any_of(passes_.begin(), passes_.end(),
                                     [t](const auto& pass) { return pass.first <= t && t <= pass.second; });
    if (covered) return false;
    begin_ = std::min(begin_, t);
    end_ = t;
    return true;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, double>> passes_;  ///< first and last stamp taken of each finished pass
  double newest_ = -kNever;                        ///< newest stamp of the present pass
  double begin_ = kNever, end_ = -kNever;          ///< first and last stamp taken of the present pass
};

}  // namespace vip_slam
