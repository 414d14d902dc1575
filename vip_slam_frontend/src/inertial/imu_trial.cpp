// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/imu_trial.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/filter/propagation.h"
#include "vip_slam_frontend/inertial/motion_difference.h"
#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

std::optional<TrialResult> ImuTrial::add(const WindowState& window, const Matrix15d& P,
                                         const std::vector<ImuSample>& samples, const MotionFit& motion,
                                         const ImuNoise& noise, double gravity) {
  if (samples.size() < 2 || (!starts_.empty() && starts_.back().samples.back().t != samples.front().t)) reset();
  if (samples.size() < 2) return std::nullopt;
  Start start{window, P, {samples.front()}, SE3()};
  start.window.clones = {window.clones.back()};
  // Both ends are compared as they are estimated now.
  start.window.clones.back().T_W_I_fej = start.window.clones.back().T_W_I;
  start.window.v_W_fej = start.window.v_W;
  starts_.push_back(std::move(start));
  const SE3& T_now_last = motion.T_current_previous;
  // What no covariance knows of it is new in each interval.
  const Matrix6d of_images = motion.covariance + std::pow(kMotionError, 2) * Matrix6d::Identity();
  for (Start& s : starts_) {
    s.samples.insert(s.samples.end(), samples.begin() + 1, samples.end());
    // T_now_start = T_now_last T_last_start, each perturbed as by boxplus().
    Matrix6d of_last = Matrix6d::Identity(), of_motion = Matrix6d::Identity();
    of_last.bottomRightCorner<3, 3>() = T_now_last.R();
    of_motion.topLeftCorner<3, 3>() = s.T_now_start.R().transpose();
    of_motion.bottomLeftCorner<3, 3>() = -T_now_last.R() * hat(s.T_now_start.t());
    s.covariance = of_last * s.covariance * of_last.transpose() + of_motion * of_images * of_motion.transpose();
    s.T_now_start = T_now_last * s.T_now_start;
  }
  while (starts_.size() > 1 && starts_[1].duration() >= kMoment) starts_.pop_front();
  const Start& oldest = starts_.front();
  const SE3& T_I_C = oldest.window.T_I_C;
  const Propagation propagation = propagate(oldest.window, oldest.samples, noise, gravityVector(gravity));
  const SE3 T_now_start = (propagation.predicted.T_W_I * T_I_C).inverse() * oldest.window.clones.back().T_W_I * T_I_C;
  Matrix6d covariance = oldest.covariance + motionCovariance(propagation, oldest.P, T_I_C);
  admitMotionError(T_now_start, 0.0, &covariance);
  TrialResult result{oldest.duration(), motionDifference(oldest.T_now_start, T_now_start, covariance)};
  const Vector6d difference = oldest.T_now_start.boxminus(T_now_start);
  constexpr double by_chance = 6;  // expected square, in sigmas
  const double beyond = std::sqrt(std::max(0.0, 1 - by_chance / std::pow(std::max(result.sigmas, 1e-9), 2)));
  refuted_ = last_;
  last_ = {result.duration, beyond * difference.head<3>().norm(), beyond * difference.tail<3>().norm()};
  return result;
}

}  // namespace vip_slam::frontend
