// How far the newest pose can be trusted: tracking, coasting, lost.
#include <algorithm>
#include <cmath>

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// A filter that has just started has not yet shown that its velocity is right, s.
constexpr double kSettled = 2.0;
// What walks about pauses, and then follows the camera, for so long, s.
constexpr double kPauses = 1.0;
// LOST with everything in view moving against the IMU for so many times the coasting time: the IMU is wrong after all.
constexpr double kPatience = 2.0;
// No IMU is worse than its data sheet by this; with axes, signs or units mixed up the factor goes to its limit of 30,
// while a camera turned by a degree or a delay of 10 ms leave it at 1.
constexpr double kImplausibleNoise = 10.0;

}  // namespace

double FrontEnd::Impl::coastedSigma() const {
  const double variance = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  return std::sqrt(std::max(0.0, variance - last_good_variance_));
}

bool FrontEnd::Impl::imuIsContradicted() const { return filter_.imuNoiseScale() > kImplausibleNoise; }

bool FrontEnd::Impl::movedLately(double t_imu) const { return t_imu - moving_imu_t_ < kPauses; }

ForetoldMotion FrontEnd::Impl::foretell(const Propagation& propagation, const SE3& T_odom_C, bool imu_gap) const {
  const NavState& from = filter_.nav();
  ForetoldMotion motion;
  motion.T_current_previous = T_odom_C.inverse() * (from.T_W_I * extrinsics());
  motion.sigma = propagation.displacementSigma(filter_.covariance());
  motion.wary = movedLately(propagation.predicted.t);
  motion.at_rest = stillness_.imuRests();
  const bool settled = options_.tracking.leave_out_moving && propagation.predicted.t - started_imu_t_ > kSettled;
  motion.interval = settled && !imu_gap ? propagation.predicted.t - from.t : 0.0;
  return motion;
}

bool FrontEnd::Impl::contradictedForLong(const TrackingResult& tracking, double t) const {
  return tracking.moves_by_itself && phase_ == Phase::kLost &&
         (t - last_held_t_ > kPatience * options_.recovery.coast_seconds ||
          coastedSigma() > options_.recovery.max_position_sigma);
}

void FrontEnd::Impl::judge(const TrackingResult& tracking, bool metric, bool surfaces_hold, double t) {
  if (metric) last_metric_t_ = t;
  if (tracking.tracked >= options_.recovery.min_tracks || still_) {
    if (phase_ == Phase::kLost) return;
    last_good_t_ = last_held_t_ = t;
    last_good_variance_ = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
    if (imuIsContradicted()) {
      status_ = {TrackingState::kDegraded,
                 "the images contradict the IMU: are its axes, signs and units, T_imu_cam and the stamps right? "
                 "check_bag tells"};
    } else if (t - last_metric_t_ > kBetweenDepths && !still_) {
      status_ = {TrackingState::kDegraded, "no depth: visual-inertial only"};
    } else {
      status_ = {TrackingState::kTracking, ""};
    }
    return;
  }
  if (surfaces_hold && phase_ != Phase::kLost) last_held_t_ = t;
  counters_.coasting += !surfaces_hold;
  const double seconds = t - last_held_t_;
  if (phase_ != Phase::kLost &&
      (seconds > options_.recovery.coast_seconds || coastedSigma() > options_.recovery.max_position_sigma)) {
    phase_ = Phase::kLost;
    ++counters_.lost;
  }
  if (phase_ == Phase::kLost) {
    const std::string missing = tracking.moves_by_itself ? "nothing that stands still" : "no features";
    status_ = {TrackingState::kLost, missing + " for " + std::to_string(t - last_good_t_).substr(0, 4) + " s"};
    return;
  }
  const std::string held = surfaces_hold              ? "held by depth surfaces and the IMU"
                           : tracking.moves_by_itself ? "what fills the view moves: coasting on the IMU"
                                                      : "coasting on the IMU";
  status_ = {TrackingState::kDegraded, held + " with " + std::to_string(tracking.tracked) + " features"};
}

}  // namespace vip_slam
