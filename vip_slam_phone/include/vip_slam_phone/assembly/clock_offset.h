// SPDX-License-Identifier: BSD-3-Clause
// The phone's clock against ours. What the network adds to an arrival is never negative: the smallest of
// (arrival - stamp) is the offset and the shortest way.
#pragma once

#include <limits>

namespace vip_slam::phone {

class ClockOffset {
 public:
  /// A record stamped `remote` (s of the phone) came at `local` (s of ours). Not until kStart seconds of them have
  /// come is the offset known; then it follows the phone's drift by slewing, so that stamps never jump.
  void add(double remote, double local) {
    const double seen = local - remote;
    if (window_begin_ == kNone) window_begin_ = local;
    if (seen < smallest_) smallest_ = seen;
    if (local - window_begin_ < (ready_ ? kWindow : kStart)) return;
    if (!ready_) {
      ready_ = true;
      base_ = smallest_;
      slew_ = 0;
    } else {
      base_ = offsetAt(remote);
      const double error = smallest_ - base_;
      // Slowly up, since a busy network looks the same; faster down, since nothing comes before it was sent.
      slew_ = error / kWindow;
      if (slew_ > kMaxUp) slew_ = kMaxUp;
      if (slew_ < -kMaxDown) slew_ = -kMaxDown;
    }
    since_ = remote;
    window_begin_ = local;
    smallest_ = std::numeric_limits<double>::infinity();
  }

  bool ready() const { return ready_; }
  /// Time of ours, s, for one of the phone's. Only when ready().
  double toLocal(double remote) const { return remote + offsetAt(remote); }
  double offsetAt(double remote) const { return base_ + slew_ * clampPast(remote - since_); }
  /// Seconds per second by which the offset is moved at present.
  double slew() const { return slew_; }

  static constexpr double kStart = 1.0, kWindow = 5.0;  ///< s
  static constexpr double kMaxUp = 1e-4, kMaxDown = 1e-3;

 private:
  // A stamp from before the last change of the slew keeps what it had, within the window's error; one far ahead of the
  // records that keep the clock is not extrapolated.
  static double clampPast(double s) { return s < 0 ? 0 : s > 2 * kWindow ? 2 * kWindow : s; }
  static constexpr double kNone = -std::numeric_limits<double>::infinity();
  bool ready_ = false;
  double window_begin_ = kNone;
  double smallest_ = std::numeric_limits<double>::infinity();
  double base_ = 0, slew_ = 0, since_ = 0;
};

}  // namespace vip_slam::phone
