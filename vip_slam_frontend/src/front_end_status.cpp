// How far the newest pose can be trusted: tracking, coasting, lost.
#include <algorithm>
#include <cmath>

#include "front_end_impl.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kRangeShown = 0.5;  // s

}  // namespace

double FrontEnd::Impl::coastedSigma() const {
  const double variance = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  return std::sqrt(std::max(0.0, variance - last_good_variance_));
}

void FrontEnd::Impl::judge(const TrackingResult& tracking, bool metric, bool surfaces_hold, double t) {
  if (metric) last_metric_t_ = t;
  if (tracking.tracked >= options_.recovery.min_tracks || still_) {
    if (phase_ == Phase::kLost) return;
    last_good_t_ = last_held_t_ = t;
    last_good_variance_ = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
    if (imuIsContradicted()) {
      status_ = {TrackingState::kDegraded,
                 "the images contradict the IMU: are its axes, signs and units, T_imu_cam, the stamps and the scale of "
                 "depth right? "
                 "check_bag tells"};
    } else if (t + timeOffset() - silent_imu_t_ < kRangeShown) {
      status_ = {TrackingState::kDegraded, "no IMU samples: held by images and depth"};
    } else if (t + timeOffset() - fault_t_ < kRangeShown) {
      status_ = {TrackingState::kDegraded, "the IMU contradicts what is seen: held by images and depth"};
    } else if (t + timeOffset() - cut_off_imu_t_ < kRangeShown) {
      status_ = {TrackingState::kDegraded,
                 formatted("the gyroscope is at the end of its range, %.2f rad/s", inertial_.range().end())};
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
  // Neither images nor an IMU tell the motion.
  const bool blind = !inertial_.complete() || silent_imu_t_ == last_imu_t_;
  const double patience = blind ? longestImuGap() : options_.recovery.coast_seconds;
  if (phase_ != Phase::kLost && (seconds > patience || coastedSigma() > options_.recovery.max_position_sigma)) {
    phase_ = Phase::kLost;
    ++counters_.lost;
  }
  if (phase_ == Phase::kLost) {
    const std::string missing = tracking.moves_by_itself ? "nothing that stands still" : "no features";
    status_ = {TrackingState::kLost, missing + formatted(" for %.2f s", t - last_good_t_)};
    return;
  }
  const std::string coasting = blind ? "coasting at the last velocity" : "coasting on the IMU";
  const std::string held = surfaces_hold ? blind ? "held by depth surfaces" : "held by depth surfaces and the IMU"
                           : tracking.moves_by_itself ? "what fills the view moves: " + coasting
                                                      : coasting;
  status_ = {TrackingState::kDegraded, held + " with " + std::to_string(tracking.tracked) + " features"};
}

}  // namespace vip_slam
