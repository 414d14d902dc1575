// SPDX-License-Identifier: BSD-3-Clause
// Whether messages have been dropped recently, not ever: diagnostics that keep warning after one hiccup at the start
// would be ignored.
#pragma once

#include <cstddef>
#include <limits>

namespace vip_slam {

class DropWatch {
 public:
  /// `total`: messages dropped so far; a smaller value than before starts a new count. `now`: seconds on a monotonic
  /// clock. True when some were dropped within the last 30 s, as seen by these calls.
  bool lately(std::size_t total, double now) {
    if (total > last_) since_ = now;
    last_ = total;
    return now - since_ <= kLately;
  }

 private:
  static constexpr double kLately = 30.0;  // s
  std::size_t last_ = 0;
  double since_ = -std::numeric_limits<double>::infinity();
};

}  // namespace vip_slam
