// Whether messages are being dropped, as against: once were. Diagnostics that warn for good after one hiccup at the
// start teach people not to look.
#pragma once

#include <cstddef>
#include <limits>

namespace vip_slam {

class DropWatch {
 public:
  /// `total`: messages dropped so far; a smaller one than before begins a new count. `now`: seconds on a clock that
  /// does not run back. True when some were dropped within the last 30 s as far as the calls tell.
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
