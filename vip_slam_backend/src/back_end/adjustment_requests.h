// SPDX-License-Identifier: BSD-3-Clause
// Whether a global adjustment is due, and which ones under way still hold.
#pragma once

#include <cstdint>

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

  /// A loop was closed that `moved` the map by a noticeable amount, or hardly: in a room that is seen again and again
  /// each loop would cost an adjustment, so those that move nothing ask for none.
  void loopClosed(bool moved) {
    if (moved) startOver();
  }
  /// Of another map.
  void reset() {
    outdate();
    wanted_ = false;
  }

 private:
  bool wanted_ = false;
  std::uint64_t correction_ = 0;
};

}  // namespace vip_slam
