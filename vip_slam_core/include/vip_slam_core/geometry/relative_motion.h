// SPDX-License-Identifier: BSD-3-Clause
// A measured motion of the body with its covariance, as between two poses of an odometry.
#pragma once

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct RelativeMotion {
  SE3 T_a_b;  ///< the body at b in its frame at a
  /// Of (theta, t), rad and m, with R_a_b <- R_a_b Exp(theta), t_a_b <- t_a_b + t. Zero: nothing is known.
  Matrix6d covariance = Matrix6d::Zero();

  bool known() const { return covariance(0, 0) != 0; }
  /// Finite, and the covariance symmetric and positive definite.
  bool isUsable() const;
};

/// Composition of two motions, whose errors are taken as independent. Unknown when one of them is.
RelativeMotion compose(const RelativeMotion& ab, const RelativeMotion& bc);

}  // namespace vip_slam
