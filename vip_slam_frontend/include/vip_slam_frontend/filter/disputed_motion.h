// SPDX-License-Identifier: BSD-3-Clause
// The part of the pose that the filter's predictions and its updates dispute: what the updates of the last second
// corrected of the predicted poses. Corrections by a consistent filter are white, and what they add up to has the
// covariance that the updates have removed. More than that is a dispute: one of the two is wrong, or both (an IMU in
// wrong axes, torn images, a body that fills the view, blur), and the filter has mixed them. The sum is then one sigma
// of the pose's error.
#pragma once

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam::frontend {

class DisputedMotion {
 public:
  /// One update at time t, s: what it corrected of the pose, and what it removed of its variances; (theta, p) in the
  /// world's axes.
  void add(double t, const Vector6d& correction, const Vector6d& removed);
  /// Whether the corrections of the last second are no chance (kGateSigmas).
  bool isSignificant() const;
  /// Variance of the pose that is in dispute, (theta, p) in the world's axes, rad^2 and m^2; no more than chance while
  /// corrections are what is expected. Each part of it is taken once.
  Vector6d take();
  void reset() { *this = DisputedMotion(); }

 private:
  double t_ = -1e300;
  Vector6d sum_ = Vector6d::Zero();       ///< of corrections, fading
  Vector6d expected_ = Vector6d::Zero();  ///< its variance in a consistent filter
  Vector6d taken_ = Vector6d::Zero();     ///< of its excess, by take()
};

}  // namespace vip_slam::frontend
