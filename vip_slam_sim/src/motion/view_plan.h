// SPDX-License-Identifier: BSD-3-Clause
// Motion planning: position and viewing direction of the camera over time, converted to the spline of the IMU.
#pragma once

#include <functional>
#include <string>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_sim/motion/motion_generator.h"
#include "vip_slam_sim/rng.h"

namespace vip_slam {

/// Position and viewing direction of the camera: yaw and pitch of its forward axis, roll about it (rad).
struct View {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0, pitch = 0, roll = 0;
  double liveliness = 0;  ///< 0 at rest to 1 in motion: scales the shake

  /// T_W_cam.
  SE3 pose() const;
};

/// A few sines with random phases: smooth, never repeating within a sequence, about unit amplitude.
class Wander {
 public:
  Wander(Rng& rng, double frequency);
  double operator()(double t) const;

 private:
  std::vector<double> f_, phase_;
};

/// Adds the shake of a hand-held camera of a walker or of a hovering drone.
class Shake {
 public:
  Shake(const std::string& style, double yaw_swing, int seed);
  void apply(double t, View* view) const;

 private:
  std::string style_;
  double swing_;
  Rng rng_;
  Wander slow_yaw_, slow_pitch_, x_, y_, z_, roll_, jitter_yaw_, jitter_pitch_;
};

/// From 0 at s = 0 to 1 at s = 1 with vanishing first and second derivatives at both.
double smoothStep(double s);

SplineTrajectory splineOf(const std::function<View(double)>& plan, double duration, const SE3& T_imu_cam);

/// Along MotionOptions::waypoints. Throws std::invalid_argument that names what was expected.
SplineTrajectory makePath(const MotionOptions& options, const SE3& T_imu_cam, int seed);

}  // namespace vip_slam
