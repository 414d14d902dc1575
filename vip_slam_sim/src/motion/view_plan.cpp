// SPDX-License-Identifier: BSD-3-Clause
#include "view_plan.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

constexpr double kKnot = 0.1;  ///< s between control poses

}  // namespace

SE3 View::pose() const {
  Eigen::Matrix3d level;  // camera axes in a level body: right, down, forward
  level.col(0) = Eigen::Vector3d(0, -1, 0);
  level.col(1) = Eigen::Vector3d(0, 0, -1);
  level.col(2) = Eigen::Vector3d(1, 0, 0);
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix() *
      level;
  return SE3(R, p);
}

Wander::Wander(Rng& rng, double frequency) {
  for (double k : {0.61, 1.0, 1.57}) {
    f_.push_back(2 * M_PI * frequency * k * rng.uniform(0.9, 1.1));
    phase_.push_back(rng.uniform(0, 2 * M_PI));
  }
}

double Wander::operator()(double t) const {
  double s = 0;
  for (std::size_t i = 0; i < f_.size(); ++i) s += std::sin(f_[i] * t + phase_[i]);
  return s / 1.8;
}

Shake::Shake(const std::string& style, double yaw_swing, int seed)
    : style_(style),
      swing_(yaw_swing * kDegree),
      rng_(seed * 977 + 5),
      slow_yaw_(rng_, 0.12),
      slow_pitch_(rng_, 0.16),
      x_(rng_, 0.45),
      y_(rng_, 0.5),
      z_(rng_, 0.4),
      roll_(rng_, 0.5),
      jitter_yaw_(rng_, 1.1),
      jitter_pitch_(rng_, 1.3) {}

void Shake::apply(double t, View* view) const {
  const double e = view->liveliness;
  if (style_ == "smooth" || e <= 0) return;
  view->yaw += e * swing_ * slow_yaw_(t);
  const Eigen::Vector3d left(-std::sin(view->yaw), std::cos(view->yaw), 0);
  const Eigen::Vector3d ahead(std::cos(view->yaw), std::sin(view->yaw), 0);
  if (style_ == "handheld") {
    const double step = 2 * M_PI * 1.75 * t;
    view->p += e * (left * (0.014 * std::sin(step / 2) + 0.015 * y_(t)) + ahead * 0.008 * std::sin(step + 1));
    view->p.z() += e * (0.012 * std::sin(step) + 0.02 * z_(t));
    view->pitch += e * kDegree * (3.5 * slow_pitch_(t) + 0.7 * std::sin(step + 0.6) + 0.4 * jitter_pitch_(t));
    view->roll += e * kDegree * (1.2 * std::sin(step / 2 + 0.4) + 1.5 * roll_(t));
    view->yaw += e * kDegree * (0.8 * std::sin(step / 2 + 2) + 0.5 * jitter_yaw_(t));
  } else {
    view->p += e * (left * 0.03 * y_(t) + ahead * 0.03 * x_(t));
    view->p.z() += e * 0.05 * z_(t);
    view->pitch += e * kDegree * (2.5 * slow_pitch_(t) + 0.5 * jitter_pitch_(t));
    view->roll += e * kDegree * 2.0 * roll_(t);
    view->yaw += e * kDegree * 0.6 * jitter_yaw_(t);
  }
}

double smoothStep(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

SplineTrajectory splineOf(const std::function<View(double)>& plan, double duration, const SE3& T_imu_cam) {
  std::vector<SE3> control;
  const int spans = std::max(1, static_cast<int>(std::lround(duration / kKnot)));
  const SE3 T_cam_imu = T_imu_cam.inverse();
  for (int k = 0; k < spans + 5; ++k) control.push_back(plan((k - 2) * kKnot).pose() * T_cam_imu);
  return SplineTrajectory(0, kKnot, control);
}

}  // namespace vip_slam
