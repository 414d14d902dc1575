// Images and IMU that contradict each other: images that come again, shocks that the IMU missed, what moves by itself,
// an IMU that is wrong, or missing.
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/same_pixels.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// A filter that has just started has not yet shown that its velocity is right, s.
constexpr double kSettled = 2.0;
// What walks about pauses, and then follows the camera, for so long, s.
constexpr double kPauses = 1.0;
// Everything in view moving against the IMU for so many times the coasting time: the IMU, or the velocity that was made
// of it, is wrong after all.
constexpr double kPatience = 2.0;
// No IMU is worse than its data sheet by this; with axes, signs or units mixed up the factor goes to its limit of 30,
// while a camera turned by a degree or a delay of 10 ms leave it at 1.
constexpr double kImplausibleNoise = 10.0;
// The same pixels may come again while the IMU rests and foretells less image motion than this: what is rendered
// without noise looks like that when it stands.
constexpr double kStandsPx = 0.5;
// The translation between two images may be off the foretold one by so many sigmas, or the IMU has missed something;
// this speed and length, m/s and m, are a sigma of what neither knows of (rows, a delay). At four ordinary images did.
constexpr double kShockSigmas = 6.0, kUntoldSpeed = 0.0125, kUntoldLength = 2.5e-4;
// A repeated image is no fault for so long, s.
constexpr double kFrozen = 0.3;
// A shock shows when so many points tell one motion, with no more than one in so many against it.
constexpr int kShockTracks = 30, kShockOutliers = 20;
// It comes out of the blue: for so long before, images have agreed with a share of that. An IMU or a velocity that is
// wrong departs little by little. It is over in so much time, s.
constexpr double kCalm = 0.5, kDoubt = 0.7, kShockLasts = 0.1;
// So long after the last image a hand may have turned the camera elsewhere, s; twice as long and by more than this
// angle from what the IMU foretold, rad, the filter's step is too far from where it is linearised.
constexpr double kLongUnseen = 0.2, kFarTurn = 0.05;

}  // namespace

bool FrontEnd::Impl::imuIsContradicted() const { return filter_.imuNoiseScale() > kImplausibleNoise; }

bool FrontEnd::Impl::movedLately(double t_imu) const { return t_imu - moving_imu_t_ < kPauses; }

ForetoldMotion FrontEnd::Impl::foretell(const Propagation& propagation, const SE3& T_odom_C, bool imu_gap) const {
  const NavState& from = filter_.nav();
  ForetoldMotion motion;
  motion.T_current_previous = T_odom_C.inverse() * (from.T_W_I * extrinsics());
  motion.sigma = propagation.displacementSigma(filter_.covariance());
  motion.turn_unknown = imu_gap;
  motion.wary = movedLately(propagation.predicted.t);
  motion.at_rest = stillness_.imuRests();
  const bool settled = options_.tracking.leave_out_moving && propagation.predicted.t - started_imu_t_ > kSettled;
  motion.interval = settled && !imu_gap ? propagation.predicted.t - from.t : 0.0;
  return motion;
}

bool FrontEnd::Impl::bridgesGap(const TrackingResult& tracking, std::size_t tracks_before,
                                const ForetoldMotion& foretold, double unseen) {
  if (unseen < kLongUnseen) return true;
  if (!tracking.pose_ok || 2 * static_cast<std::size_t>(tracking.tracked) < tracks_before) return false;
  const SE3 apart = foretold.T_current_previous.inverse() * tracking.T_current_previous;
  return unseen < 2 * kLongUnseen || logSO3(apart.R()).norm() < kFarTurn;
}

bool FrontEnd::Impl::contradictedForLong(const TrackingResult& tracking, double t) const {
  if (!tracking.moves_by_itself) return false;
  const double patience = kPatience * options_.recovery.coast_seconds;
  if (t - last_agreed_t_ > patience) return true;
  return phase_ == Phase::kLost &&
         (t - last_held_t_ > patience || coastedSigma() > options_.recovery.max_position_sigma);
}

void FrontEnd::Impl::noteAgreement(const TrackingResult& tracking, double t) {
  const int needed = options_.recovery.min_tracks;
  const auto& tracks = tracker_.tracks();
  const auto held = std::count_if(tracks.begin(), tracks.end(), [](const Track& track) {
    return track.feature.depth > 0 && track.feature.age >= kOldPoint;
  });
  const bool agrees = tracking.moves_by_itself ? held >= needed : tracking.pose_ok && tracking.tracked >= 2 * needed;
  if (still_ || agrees) last_agreed_t_ = t;
}

bool FrontEnd::Impl::movesByImu(double t_imu, const SE3& T_odom_C_then) const {
  const ZuptOptions& rest = options_.filter.zupt;
  const double since = std::max(imu_.oldest(), std::min(t_imu - rest.window, filter_.nav().t));
  if (!imuSpread(imu_.between(since, t_imu), &sensor_.imu_noise).quiet(rest.max_gyro_std, rest.max_accel_std)) {
    return true;
  }
  const std::vector<ImuSample> samples = imu_.between(filter_.nav().t, t_imu);
  if (samples.size() < 2) return true;
  const SE3 T_now_then = (filter_.predict(samples).predicted.T_W_I * extrinsics()).inverse() * T_odom_C_then;
  std::vector<double> moved;
  for (const Eigen::Vector3d& then : trackedPoints()) {
    const Eigen::Vector3d now = T_now_then * then;
    if (now.z() > 0) moved.push_back((now.hnormalized() - then.hnormalized()).norm() * camera_->focal());
  }
  if (moved.empty()) return true;
  std::nth_element(moved.begin(), moved.begin() + moved.size() / 2, moved.end());
  return moved[moved.size() / 2] > kStandsPx;
}

bool FrontEnd::Impl::repeatsLastImage(const cv::Mat& gray, double t_imu) const {
  return !still_ && !tracker_.tracks().empty() && samePixels(gray, tracker_.gray()) &&
         movesByImu(t_imu, filter_.nav().T_W_I * extrinsics());
}

FrameOutput FrontEnd::Impl::repeatedImage(double t, double t_imu) {
  ++counters_.repeated_image;
  // A camera that is slower than its topic says nothing in between, which is no fault.
  if (phase_ == Phase::kTracking && t_imu - filter_.nav().t < kFrozen)
    return statusOnly(t, status_.state, status_.reason);
  return unusable(t, "the image repeats the one before: has the camera frozen?");
}

void FrontEnd::Impl::admitShock(const TrackingResult& tracking, const ForetoldMotion& foretold, double dt,
                                Propagation* propagation) {
  const double t = propagation->predicted.t;
  const bool told = foretold.interval > 0 && !foretold.wary && !tracking.moves_by_itself && tracking.step.ok &&
                    tracking.tracked >= kShockTracks && kShockOutliers * tracking.lost_outlier <= tracking.tracked;
  const Eigen::Vector3d apart = tracking.step.t - foretold.T_current_previous.t();
  const double length = kUntoldSpeed * dt + kUntoldLength;
  const Eigen::Matrix3d C =
      tracking.step.covariance + (std::pow(foretold.sigma, 2) + std::pow(length, 2)) * Eigen::Matrix3d::Identity();
  const double sigmas = told ? std::sqrt(apart.dot(C.inverse() * apart)) : 0.0;
  const bool doubtful = sigmas > kDoubt * kShockSigmas;
  if (!told || doubtful) {
    if (t - doubt_imu_t_ > kCalm) shock_imu_t_ = t;
    doubt_imu_t_ = t;
  }
  // A shock may begin at the end of one interval and show in the next one.
  const bool begins = doubtful && shock_imu_t_ == t;
  const bool goes_on = sigmas > kShockSigmas && t - shock_imu_t_ <= std::max(kShockLasts, 1.5 * dt);
  if (!told || !(begins || goes_on)) return;
  counters_.imu_shocks += sigmas > kShockSigmas;
  propagation->admitStep(apart.norm() / dt, dt);
}

}  // namespace vip_slam
