// Contradictions between images and IMU: repeated images, faults of the IMU, bodies that move independently of
// the camera, an IMU that is wrong or missing.
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/same_pixels.h"
#include "vip_slam_core/util/statistics.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// Time after the start during which the filter's velocity is not yet trusted to judge the points, s.
constexpr double kSettled = 2.0;
// A moving body that pauses looks static: for this long after one was last seen moving the images stay in doubt, s.
constexpr double kPauses = 1.0;
// Factor on coast_seconds: when everything in view contradicts the IMU for longer, the IMU, or the velocity integrated
// from it, is taken to be wrong.
constexpr double kPatience = 2.0;
// Factor on the IMU's noise that no sound IMU reaches: with wrong axes, signs or units the adapted factor goes to its
// limit of 30, while extrinsics that are wrong by a degree or a delay of 10 ms leave it at 1.
constexpr double kImplausibleNoise = 10.0;
// An image may repeat the one before while the IMU is at rest and predicts less image motion than this, px: a standing
// camera that is simulated without noise renders equal images.
constexpr double kStandsPx = 0.5;
// Errors of the prediction that no covariance has (rolling shutter, delay, extrinsics), one sigma: a share of the turn
// and an angle, rad; by the time and a length, m/s and m.
constexpr double kUnmodelledTurn = 0.05, kUnmodelledAngle = 1e-3;
constexpr double kUnmodelledSpeed = 0.0125, kUnmodelledLength = 2.5e-4;
// Repeated images are reported as a fault only after this time, s.
constexpr double kFrozen = 0.3;
// Images agree among themselves with at least this many points with depth, and one outlier per kAgreeingOutliers.
constexpr int kAgreeing = 30, kAgreeingOutliers = 10;
// Time without images after which the camera may look elsewhere, s. After twice that time a rotation further than
// kFarTurn, rad, from the predicted one is too far from the filter's linearisation point.
constexpr double kLongUnseen = 0.2, kFarTurn = 0.05;

}  // namespace

bool FrontEnd::Impl::imuIsContradicted() const { return filter_.imuNoiseScale() > kImplausibleNoise; }

bool FrontEnd::Impl::movedLately(double t_imu) const { return t_imu - moving_imu_t_ < kPauses; }

PredictedMotion FrontEnd::Impl::predictMotion(const Propagation& propagation, const SE3& T_odom_C,
                                              bool doubtful) const {
  const NavState& from = filter_.nav();
  PredictedMotion motion;
  motion.T_current_previous = T_odom_C.inverse() * (from.T_W_I * extrinsics());
  motion.sigma = propagation.displacementSigma(filter_.covariance());
  motion.interval = propagation.predicted.t - from.t;
  motion.turn_unknown = doubtful;
  motion.wary = movedLately(propagation.predicted.t);
  motion.at_rest = stillness_.imuRests();
  const bool settled = options_.tracking.leave_out_moving && propagation.predicted.t - started_imu_t_ > kSettled;
  motion.judges = settled && !doubtful;
  return motion;
}

bool FrontEnd::Impl::bridgesGap(const TrackingResult& tracking, std::size_t tracks_before,
                                const PredictedMotion& prediction, double unseen) {
  if (unseen < kLongUnseen) return true;
  if (!tracking.pose_ok || 2 * static_cast<std::size_t>(tracking.tracked) < tracks_before) return false;
  const SE3 apart = prediction.T_current_previous.inverse() * tracking.T_current_previous;
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
  const double since = std::max(inertial_.oldest(), std::min(t_imu - rest.window, filter_.nav().t));
  if (!imuSpread(inertial_.between(since, t_imu), &sensor_.imu_noise).quiet(rest.max_gyro_std, rest.max_accel_std)) {
    return true;
  }
  const std::vector<ImuSample> samples = inertial_.between(filter_.nav().t, t_imu);
  if (samples.size() < 2) return true;
  const SE3 T_now_then = (filter_.predict(samples).predicted.T_W_I * extrinsics()).inverse() * T_odom_C_then;
  std::vector<double> moved;
  for (const Eigen::Vector3d& then : trackedPoints()) {
    const Eigen::Vector3d now = T_now_then * then;
    if (now.z() > 0) moved.push_back((now.hnormalized() - then.hnormalized()).norm() * camera_->focal());
  }
  if (moved.empty()) return true;
  return upperMedian(std::move(moved)) > kStandsPx;
}

bool FrontEnd::Impl::repeatsLastImage(const cv::Mat& gray, double t_imu) const {
  return !still_ && !tracker_.tracks().empty() && samePixels(gray, tracker_.gray()) &&
         movesByImu(t_imu, filter_.nav().T_W_I * extrinsics());
}

FrameOutput FrontEnd::Impl::repeatedImage(double t, double t_imu) {
  ++counters_.repeated_image;
  // A camera slower than its topic repeats images in between, which is no fault.
  if (phase_ == Phase::kTracking && t_imu - filter_.nav().t < kFrozen)
    return statusOnly(t, status_.state, status_.reason);
  return unusable(t, "the image repeats the one before: has the camera frozen?");
}

bool FrontEnd::Impl::imuIsAtFault(const TrackingResult& tracking, const PredictedMotion& prediction,
                                  const Propagation& propagation) {
  frontend::MotionEvidence evidence;
  evidence.t = propagation.predicted.t;
  evidence.interval = prediction.interval;
  evidence.images_agree = !prediction.turn_unknown && options_.tracking.leave_out_moving && !prediction.wary &&
                          !tracking.moves_by_itself && tracking.motion.ok && tracking.motion.pairs >= kAgreeing &&
                          kAgreeingOutliers * tracking.lost_outlier <= tracking.tracked;
  if (evidence.images_agree) {
    const Matrix15d P = filter_.covariance();
    const Eigen::Matrix3d R_C_I = extrinsics().R().transpose();
    const Eigen::Matrix3d R_C_W = R_C_I * propagation.predicted.T_W_I.R().transpose();
    Matrix6d covariance = tracking.motion.covariance;
    covariance.topLeftCorner<3, 3>() += R_C_I * propagation.turnCovariance(P) * R_C_I.transpose();
    covariance.bottomRightCorner<3, 3>() += R_C_W * propagation.displacementCovariance(P) * R_C_W.transpose();
    const double turn = kUnmodelledTurn * propagation.omega_I.norm() * prediction.interval + kUnmodelledAngle;
    const double length = kUnmodelledSpeed * prediction.interval + kUnmodelledLength;
    covariance.diagonal().head<3>().array() += turn * turn;
    covariance.diagonal().tail<3>().array() += length * length;
    evidence.sigmas =
        frontend::motionDifference(tracking.motion.T_current_previous, prediction.T_current_previous, covariance);
  }
  const bool fault = faults_.add(evidence);
  counters_.imu_faults += fault;
  return fault;
}

}  // namespace vip_slam
