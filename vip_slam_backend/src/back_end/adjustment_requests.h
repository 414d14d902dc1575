// SPDX-License-Identifier: BSD-3-Clause
// Whether a global adjustment is due, and which ones under way still hold.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

namespace vip_slam {

class AdjustmentRequests {
 public:
  bool wanted() const { return wanted_; }
  void want() { wanted_ = true; }
  void start() { wanted_ = false; }

  /// Counts loop corrections, new calibrations, loaded maps and resets: a global adjustment that started before one
  /// must not undo it.
  std::uint64_t correction() const { return correction_; }
  void outdate() { ++correction_; }
  void startOver() {
    want();
    outdate();
  }

  /// A loop was closed at time t; it `moved` the map by a noticeable amount, or hardly: in a room that is seen again
  /// and again each loop would cost an adjustment, so those that move nothing ask for one after a rest only.
  void loopClosed(double t, bool moved) {
    constexpr double kRestSeconds = 15;
    if (moved) outdate();  // small ones keep an adjustment valid, since they may be more frequent than it takes
    // Stamps run back where a bag starts over.
    if (!moved && last_loop_ && !(std::abs(t - *last_loop_) > kRestSeconds)) return;
    want();
    last_loop_ = t;
  }
  /// Of another map.
  void reset() {
    outdate();
    wanted_ = false;
    last_loop_.reset();
  }

 private:
  bool wanted_ = false;
  std::uint64_t correction_ = 0;
  std::optional<double> last_loop_;  ///< stamp of the last loop that asked for one
};

}  // namespace vip_slam
