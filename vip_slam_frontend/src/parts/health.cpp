// SPDX-License-Identifier: BSD-3-Clause
#include "parts/health.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam::frontend {

void Health::reset(const std::string& reason) {
  phase_ = Phase::kWaiting;
  status_ = {TrackingState::kInitialising, reason};
  cut_off_imu_t_ = silent_imu_t_ = fault_t_ = last_disputed_t_ = -1e300;  // the clock may have run back
}

void Health::initialising(const std::string& reason) {
  const bool restarts = waiting() && status_.state == TrackingState::kInitialising && !status_.reason.empty();
  status_ = {TrackingState::kInitialising, restarts ? status_.reason + "; " + reason : reason};
  phase_ = Phase::kInitialising;
}

void Health::start(double t, double variance) {
  phase_ = Phase::kTracking;
  status_ = {TrackingState::kTracking, ""};
  last_good_t_ = last_held_t_ = last_metric_t_ = last_points_t_ = last_agreed_t_ = t;
  last_good_variance_ = variance;
}

double Health::coastedSigma(double variance) const { return std::sqrt(std::max(0.0, variance - last_good_variance_)); }

bool Health::contradictedForLong(const Sight& sight) const {
  if (!sight.moves_by_itself) return false;
  // Then the IMU, or the velocity integrated from it, is taken to be wrong.
  const double patience = options_.max_image_gap;
  if (sight.t - last_agreed_t_ > patience) return true;
  return lost() && (sight.t - last_held_t_ > patience || coastedSigma(sight.variance) > options_.max_position_sigma);
}

std::string Health::divergence(const StepReport& report, const Sight& sight) {
  const int needed = options_.min_tracks;
  const bool agrees =
      sight.moves_by_itself ? sight.old_with_depth >= needed : sight.pose_ok && sight.tracked >= 2 * needed;
  if (sight.still || agrees) last_agreed_t_ = sight.t;

  if (!report.healthy) return "the filter became singular";
  if (contradictedForLong(sight)) return "what is seen contradicts the IMU";
  return "";
}

bool Health::resume(const Sight& sight) {
  judge(sight);
  // RANSAC gives a metric pose (pose_ok) only from points with depth; without such points, as with depth on surfaces
  // alone, tracking resumes without it.
  if (sight.with_depth >= options_.min_tracks) last_points_t_ = sight.t;
  const bool agrees = sight.pose_ok || sight.t - last_points_t_ > kMoment;
  if (!lost() || sight.tracked < 2 * options_.min_tracks || !agrees) return true;
  // The IMU was integrated throughout. While the position's uncertainty stays within bounds the odometry goes on.
  if (coastedSigma(sight.variance) > options_.max_position_sigma) return false;
  phase_ = Phase::kTracking;
  judge(sight);
  return true;
}

std::string Health::degradation(const Sight& sight) const {
  if (sight.contradicts_imu) {
    return "the images contradict the IMU: are its axes, signs and units, T_imu_cam, the stamps and the scale of depth "
           "right? check_bag tells";
  }
  if (sight.t_imu - silent_imu_t_ < kMoment) return "no IMU samples: held by images and depth";
  if (sight.t_imu - fault_t_ < kMoment) {
    if (!imu_fault_.empty()) return imu_fault_ + " Held by images and depth";
    return "the IMU contradicts what is seen: held by images and depth";
  }
  if (sight.vertical_unknown) {
    return "the IMU contradicts what is seen from its first motion on, and the vertical is not known: are its axes, "
           "signs and units, and T_imu_cam right? check_bag tells";
  }
  if (sight.t_imu - cut_off_imu_t_ < kMoment)
    return formatted("the gyroscope is at the end of its range, %.2f rad/s", gyro_range_);
  if (sight.scale_contradicts) {
    return "depth and the accelerometer disagree about distances by more than any calibration: is depth/scale right, "
           "and the IMU? check_bag tells; sigma widened";
  }
  if (sight.t - last_disputed_t_ < kMoment) {
    return "predictions and images contradict each other, cause not known (blur, torn images, something that moves, "
           "stamps?): sigma widened";
  }
  if (sight.t - last_metric_t_ > kMoment && !sight.still) return "no depth: visual-inertial only";
  return "";
}

void Health::judge(const Sight& sight) {
  if (sight.surfaces_hold || sight.with_depth >= options_.min_tracks) last_metric_t_ = sight.t;
  if (sight.disputed) last_disputed_t_ = sight.t;
  if (sight.tracked >= options_.min_tracks || sight.still) {
    if (lost()) return;
    last_good_t_ = last_held_t_ = sight.t;
    last_good_variance_ = sight.variance;
    const std::string why = degradation(sight);
    status_ = {why.empty() ? TrackingState::kTracking : TrackingState::kDegraded, why};
    return;
  }
  if (sight.surfaces_hold && !lost()) last_held_t_ = sight.t;
  counters_->coasting += !sight.surfaces_hold;
  // Without an IMU, or with one that is wrong, neither images nor samples tell the motion.
  const double patience = sight.blind || sight.contradicts_imu ? options_.longestImuGap() : options_.coast_seconds;
  if (!lost() && (sight.t - last_held_t_ > patience || coastedSigma(sight.variance) > options_.max_position_sigma)) {
    phase_ = Phase::kLost;
    ++counters_->lost;
  }
  if (lost()) {
    const std::string missing = sight.moves_by_itself ? "nothing that stands still" : "no features";
    status_ = {TrackingState::kLost, missing + formatted(" for %.2f s", sight.t - last_good_t_)};
    return;
  }
  const std::string coasting = sight.blind ? "coasting at the last velocity" : "coasting on the IMU";
  const std::string held = sight.surfaces_hold
                               ? sight.blind ? "held by depth surfaces" : "held by depth surfaces and the IMU"
                           : sight.moves_by_itself ? "what fills the view moves: " + coasting
                                                   : coasting;
  status_ = {TrackingState::kDegraded, held + " with " + std::to_string(sight.tracked) + " features"};
}

TrackingState Health::unusable(const std::string& why, bool imu_ended, double unseen) {
  if (!lost() && (imu_ended || unseen > options_.coast_seconds)) {
    phase_ = Phase::kLost;
    status_ = {TrackingState::kLost, why};  // also reported for the next images, until the state is re-evaluated
    ++counters_->lost;
  }
  return lost() ? TrackingState::kLost : TrackingState::kDegraded;
}

}  // namespace vip_slam::frontend
