// SPDX-License-Identifier: BSD-3-Clause
// The part of the pose that IMU and images disputed before the IMU was found at fault or fell silent. Until then the
// filter has mixed both: what the updates corrected of the IMU's predictions is the part of the motion that they do not
// agree on. Corrections by a consistent filter are white, and what they add up to has the covariance that the updates
// have removed; more than that is a dispute, whose sum is one sigma of the pose's error.
#pragma once

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam::frontend {

class DisputedMotion {
 public:
  /// One update at time t, s: what it corrected of the pose, and what it removed of its variances; (theta, p) in the
  /// world's axes.
  void add(double t, const Vector6d& correction, const Vector6d& removed);
  /// Variance of the pose that is in dispute, (theta, p) in the world's axes, rad^2 and m^2; no more than chance
  /// while the corrections of the last second are what is expected. Taken once: the sums begin anew.
  Vector6d take();
  void reset() { *this = DisputedMotion(); }

 private:
  double t_ = -1e300;
  Vector6d sum_ = Vector6d::Zero();       ///< of corrections, fading
  Vector6d expected_ = Vector6d::Zero();  ///< its variance in a consistent filter
};

}  // namespace vip_slam::frontend
