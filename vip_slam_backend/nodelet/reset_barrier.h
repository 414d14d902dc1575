// SPDX-License-Identifier: BSD-3-Clause
// Keeps data from before a reset out of the new map. Sensor stamps are compared with sensor stamps only, since their
// clock may differ from ROS time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>

namespace vip_slam {

/// Thread-safe: frames arrive at image rate in parallel to the owner of the map.
class ResetBarrier {
 public:
  /// To be called for each frame received.
  void see(double t, std::uint32_t epoch) {
    std::lock_guard<std::mutex> lock(mutex_);
    take(t, epoch);
  }
  void seeKeyframe(double t, std::uint32_t epoch) {
    std::lock_guard<std::mutex> lock(mutex_);
    take(t, epoch);
    if (epoch == epoch_) has_keyframe_ = true;
  }

  /// Puts the barrier after all data seen so far.
  void raise() {
    std::lock_guard<std::mutex> lock(mutex_);
    raised_ = seen_;
    barrier_t_ = t_;
    barrier_epoch_ = epoch_;
    epoch_ends_ = has_keyframe_;
  }

  /// True for data later than the barrier. A later epoch of the odometry passes whatever its stamps, and lifts the
  /// barrier, since device time may restart. An epoch that had keyframes never passes: the front end leaves it on
  /// reset, and images that it finished before belong to the old odometry. A front end still initialising keeps its
  /// epoch, whose later stamps pass.
  bool passes(double t, std::uint32_t epoch) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (raised_ && epoch > barrier_epoch_) raised_ = false;
    if (!raised_) return true;
    return epoch == barrier_epoch_ && !epoch_ends_ && t > barrier_t_;
  }

  double newest() const {  ///< stamp in the newest epoch; 0 before the first
    std::lock_guard<std::mutex> lock(mutex_);
    return seen_ ? t_ : 0.0;
  }

 private:
  void take(double t, std::uint32_t epoch) {
    if (!seen_ || epoch > epoch_) {
      t_ = t;  // stamps of the epoch before are not comparable: the clock may have run back
      epoch_ = epoch;
      has_keyframe_ = false;
    } else if (epoch == epoch_) {
      t_ = std::max(t_, t);
    }
    seen_ = true;
  }

  mutable std::mutex mutex_;
  bool seen_ = false, raised_ = false;
  bool has_keyframe_ = false;     ///< of epoch_
  bool epoch_ends_ = false;       ///< barrier_epoch_ had keyframes
  double t_ = 0, barrier_t_ = 0;  ///< t_ of epoch_
  std::uint32_t epoch_ = 0, barrier_epoch_ = 0;
};

}  // namespace vip_slam
