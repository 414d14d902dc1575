// SPDX-License-Identifier: BSD-3-Clause
// A smooth body trajectory: a uniform cumulative B-spline of degree 5 (C^4) over R^3 x SO(3) with exact derivatives.
// Source: Sommer et al. 2020, "Efficient derivative computation for cumulative B-splines on Lie groups".
#pragma once

#include <memory>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_sim/motion/vibration.h"

namespace vip_slam {

/// Motion of the body at one time. World z up.
struct MotionState {
  SE3 T_W_I;
  Eigen::Vector3d v_W, a_W;          ///< m/s, m/s^2
  Eigen::Vector3d omega_I, alpha_I;  ///< rad/s, rad/s^2, body frame
};

class SplineTrajectory {
 public:
  /// Control poses `spacing` seconds apart; the curve begins at time `begin` and needs six of them.
  /// Throws std::invalid_argument on fewer or on a spacing <= 0.
  SplineTrajectory(double begin, double spacing, std::vector<SE3> control);

  double begin() const { return begin_; }
  double end() const { return begin_ + spacing_ * static_cast<double>(control_.size() - 5); }
  /// From now on the body shakes about the curve.
  void shake(std::shared_ptr<const Vibration> vibration) { vibration_ = std::move(vibration); }
  /// t is clamped to [begin, end].
  MotionState at(double t) const;

  /// A spline that passes near given poses (stamps need not be regular): control poses every `spacing` seconds, then
  /// `iterations` corrections by the residuals at the knots. Throws std::invalid_argument when the poses are too few.
  static SplineTrajectory fit(const Trajectory& poses, double spacing, int iterations);

 private:
  MotionState smooth(double t) const;

  double begin_, spacing_;
  std::vector<SE3> control_;
  std::vector<Eigen::Vector3d> steps_;  ///< Log(R_i^-1 R_i+1)
  std::shared_ptr<const Vibration> vibration_;
};

}  // namespace vip_slam
