// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/motion/motion_generator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "view_plan.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

SplineTrajectory makeOrbit(const MotionOptions& o, const SE3& T_imu_cam, int seed) {
  Rng rng(seed * 131 + 7);
  const double a = rng.uniform(0, 2 * M_PI), b = rng.uniform(0, 2 * M_PI), c = rng.uniform(0, 2 * M_PI);
  // Several loops of unequal shape, never the same twice within a sequence.
  const auto position = [&](double s) {
    return Eigen::Vector3d(o.x + o.extent_x * (0.62 * std::sin(s + a) + 0.38 * std::sin(2.1 * s + b)),
                           o.y + o.extent_y * (0.6 * std::sin(1.27 * s + b) + 0.4 * std::sin(2.6 * s + c)),
                           o.z + o.extent_z * (0.6 * std::sin(0.83 * s + c) + 0.4 * std::sin(1.9 * s + a)));
  };
  const auto turning = [&](double s) { return 0.55 * s + 0.9 * std::sin(0.71 * s + b) + 0.35 * std::sin(1.7 * s + c); };
  double peak_p = 0, peak_yaw = 0;
  for (double s = 0; s < 60; s += 0.01) {
    peak_p = std::max(peak_p, (position(s + 5e-3) - position(s - 5e-3)).norm() / 0.01);
    peak_yaw = std::max(peak_yaw, std::abs(turning(s + 5e-3) - turning(s - 5e-3)) / 0.01);
  }
  const double rate_p = o.speed / peak_p, rate_yaw = o.max_rate / peak_yaw;
  const Shake shake(o.style, 0, seed);
  const auto plan = [&](double t) {
    const double at = t + o.start_at;
    // Phase: at rest until `hold`, then up to speed within three seconds.
    const double m = std::max(0.0, at - o.hold), ramp = 3;
    const double x = std::min(m / ramp, 1.0);
    const double phase = ramp * (x * x * x * x * (2.5 + x * (x - 3))) + std::max(0.0, m - ramp);
    View v;
    v.p = position(rate_p * phase);
    v.yaw = o.yaw * kDegree + turning(rate_yaw * phase) - turning(0);
    v.pitch = o.pitch * kDegree + 0.12 * o.max_rate * std::sin(0.9 * rate_yaw * phase);
    v.liveliness = smoothStep(m / 2);
    shake.apply(at, &v);
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 60, T_imu_cam);
}

SplineTrajectory makeRotate(const MotionOptions& o, const SE3& T_imu_cam) {
  const auto plan = [&](double t) {
    const double m = std::max(0.0, t - o.hold);
    View v;
    v.p = Eigen::Vector3d(o.x, o.y, o.z);
    // The camera turns about itself: yaw to and fro over more than a full turn, with nodding.
    const double f = o.max_rate / (1.2 * M_PI);
    v.yaw = o.yaw * kDegree + 1.2 * M_PI * (1 - std::cos(f * m));
    v.pitch = o.pitch * kDegree + 0.25 * smoothStep(m / 2) * std::sin(0.9 * m);
    v.roll = 0.1 * smoothStep(m / 2) * std::sin(0.6 * m);
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 40, T_imu_cam);
}

SplineTrajectory makeStill(const MotionOptions& o, const SE3& T_imu_cam) {
  const auto plan = [&](double) {
    View v;
    v.p = Eigen::Vector3d(o.x, o.y, o.z);
    v.yaw = o.yaw * kDegree;
    v.pitch = o.pitch * kDegree;
    return v;
  };
  return splineOf(plan, o.duration > 0 ? o.duration : 60, T_imu_cam);
}

SplineTrajectory makeFromFile(const MotionOptions& o) {
  Trajectory poses = readPoseFile(o.file);
  const SE3 place(Eigen::Quaterniond(Eigen::AngleAxisd(o.yaw * kDegree, Eigen::Vector3d::UnitZ())),
                  Eigen::Vector3d(o.x, o.y, o.z));
  const SE3 roll(Eigen::Quaterniond(Eigen::AngleAxisd(o.file_roll * kDegree, Eigen::Vector3d::UnitZ())),
                 Eigen::Vector3d::Zero());
  const double length = poses.back().t;
  Trajectory chosen;
  for (StampedPose& pose : poses) {
    pose.t -= o.start_at;
    if (pose.t < 0 || (o.duration > 0 && pose.t > o.duration)) continue;
    chosen.push_back({pose.t, place * pose.T_W_B * roll});
  }
  if (chosen.size() < 2)
    throw std::invalid_argument(formatted(
        "motion/file: %s: %zu poses from start_at %g s on within duration %g s, expected at least two; the file "
        "has %.3f s",
        o.file.c_str(), chosen.size(), o.start_at, o.duration, length));
  const double first = chosen.front().t;
  for (StampedPose& pose : chosen) pose.t -= first;
  return SplineTrajectory::fit(chosen, 0.08, 6);
}

}  // namespace

SplineTrajectory makeMotion(const MotionOptions& options, const SE3& T_imu_cam, int seed) {
  SplineTrajectory motion = options.type == "path"     ? makePath(options, T_imu_cam, seed)
                            : options.type == "orbit"  ? makeOrbit(options, T_imu_cam, seed)
                            : options.type == "rotate" ? makeRotate(options, T_imu_cam)
                            : options.type == "still"  ? makeStill(options, T_imu_cam)
                                                       : makeFromFile(options);
  if (options.vibration != "none") motion.shake(std::make_shared<Vibration>(options.vibration, seed));
  return motion;
}

}  // namespace vip_slam
