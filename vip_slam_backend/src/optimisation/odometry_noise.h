// SPDX-License-Identifier: BSD-3-Clause
// How far the odometry's motions are off, in their own sigmas: a variance component, from the map.
//
// The odometry sees a window of less than half a second. What all its measurements share over that time (lens, readout,
// depth that is off over a surface) does not show in its residuals and is not in its covariance. The map holds the same
// places over seconds. So motions over half a second to two seconds are compared, outside of any adjustment: for a
// motion with the covariance C of the odometry, which the map has otherwise by r = (theta, t), q = r^T C^-1 r / 6 has
// the mean one where C is true and the map knows the motion far better; the mean of q is the factor that C lacks. The
// map's own error counts as the odometry's.
#pragma once

#include "vip_slam_backend/map/map.h"

namespace vip_slam::backend {

class OdometryNoise {
 public:
  /// Takes in the motions to those keyframes of the newest keyframe's odometry that the map has adjusted together with
  /// a second of what came after them, each once. The newest keyframe must be in the map.
  void compare(const Map& map, KeyframeId newest);

  /// Factor on the covariance of the odometry's motions, 1 or more: its white noise is measured, and no less.
  double varianceFactor() const;

  void reset() { *this = OdometryNoise(); }

 private:
  double mean_ = kStart;  ///< of q
  double count_ = kWorthOfStart;
  KeyframeId compared_ = 0;  ///< the newest one taken in

  // What a camera is taken for that nothing is known of, and how many motions that counts as much as.
  static constexpr double kStart = 4.0, kWorthOfStart = 4.0;
};

}  // namespace vip_slam::backend
