// SPDX-License-Identifier: BSD-3-Clause
#include "parts/motion_sources.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_frontend/inertial/motion_difference.h"

namespace vip_slam::frontend {

namespace {

// Points have the same pixels as the filter's tracks, which it takes for independent: factor on their variance.
constexpr double kSharedByTracks = 9.0;
// What one alignment errs, the next one does too: in each direction, one sigma in rad and m. Judged on real recordings
// of a Kinect and an Xtion.
constexpr double kAlignedLeast = 2e-3;

}  // namespace

MotionSources::MotionSources(const SensorConfig& sensor, std::shared_ptr<const CameraModel> camera,
                             const VioFilter* filter, InertialInput* inertial)
    : imu_noise_(sensor.imu_noise),
      gravity_(sensor.gravity),
      filter_(filter),
      inertial_(inertial),
      dense_(std::move(camera), sensor.depth_noise) {}

std::optional<AlignedMotion> MotionSources::byPixels(const FeatureTracker& tracker, const cv::Mat& gray,
                                                     const DepthReading& depth, double seconds) const {
  const double depth_share = seconds > 0 ? 1 + depth.lag / seconds : 1.0;
  return dense_.motion(tracker.gray(), tracker.depth(), gray, depth.image, depth_share, last_);
}

AlignedMotion MotionSources::goingOn() const {
  AlignedMotion unknown{last_, Matrix6d::Zero()};
  unknown.covariance.diagonal().setConstant(kUsualMotion * kUsualMotion);
  return unknown;
}

SE3 MotionSources::byGyro(double t0, double t1) const {
  const std::vector<ImuSample> samples = inertial_->between(t0, t1);
  if (samples.size() < 2) return SE3();
  const Preintegration pre(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), imu_noise_);
  const Eigen::Matrix3d R_I_C = filter_->extrinsics().R();
  return SE3(Eigen::Matrix3d(R_I_C.transpose() * pre.deltaR().transpose() * R_I_C), Eigen::Vector3d::Zero());
}

Eigen::Vector3d MotionSources::rate(double t) const {
  if (!(inertial_->oldest() <= inertial_->newest())) return Eigen::Vector3d::Zero();
  const auto sample = inertial_->at(std::clamp(t, inertial_->oldest(), inertial_->newest()));
  return sample ? correctedRate(sample->gyro, filter_->window().gyro_correction) : Eigen::Vector3d::Zero();
}

PredictedMotion MotionSources::byImu(const Propagation& propagation, const SE3& T_odom_C, bool imu_missing, bool wary,
                                     bool at_rest) const {
  const NavState& from = filter_->nav();
  PredictedMotion motion;
  motion.T_current_previous = T_odom_C.inverse() * (from.T_W_I * filter_->extrinsics());
  motion.sigma = propagation.displacementSigma(filter_->covariance());
  motion.interval = propagation.predicted.t - from.t;
  motion.turn_unknown = imu_missing;
  motion.wary = wary;
  motion.at_rest = at_rest;
  motion.judges = !imu_missing;
  return motion;
}

bool MotionSources::isBeyondFlow(const SE3& motion) { return logSO3(motion.R()).norm() > kUsualMotion; }

bool MotionSources::isAnotherTurn(const AlignedMotion& seen, const SE3& predicted) const {
  return logSO3((seen.T_current_previous.inverse() * predicted).R()).norm() > kUsualMotion;
}

void MotionSources::substitute(double t0, double t1, const SE3& T_current_previous, const NavState& state,
                               bool both) const {
  if (!(t1 > t0)) return;
  Substitute stand_in{t0, t1, std::nullopt, std::nullopt};
  Eigen::Vector3d omega = rate(0.5 * (t0 + t1)) - state.bias_gyro;
  if (both || !inertial_->hasGyro()) {
    omega = filter_->extrinsics().R() * logSO3(Eigen::Matrix3d(T_current_previous.R().transpose())) / (t1 - t0);
    stand_in.gyro = omega + state.bias_gyro;
  }
  if (both || !inertial_->hasAccel()) {
    const Eigen::Matrix3d R_W_I = state.T_W_I.R() * expSO3(Eigen::Vector3d(0.5 * (t1 - t0) * omega));
    stand_in.accel = R_W_I.transpose() * gravityVector(gravity_) + state.bias_accel;
  }
  inertial_->substitute(stand_in);
}

Propagation MotionSources::byImages(double t_imu, const MotionFit& points, const AlignedMotion& pixels) const {
  const NavState from = filter_->nav();
  const bool fault = inertial_->complete();
  SE3 T_cur_prev = pixels.T_current_previous;
  Matrix6d covariance = pixels.covariance;
  admitMotionError(T_cur_prev, kAlignedLeast, &covariance);
  if (points.ok) {
    // Few points that agree by chance promise more than they hold: all pixels together gate them.
    Matrix6d of_points = kSharedByTracks * points.covariance;
    of_points.diagonal().array() += kMotionError * kMotionError;
    const Matrix6d gain = covariance * (covariance + of_points).inverse();
    if (motionDifference(points.T_current_previous, T_cur_prev, covariance + of_points) < kGateSigmas) {
      T_cur_prev = T_cur_prev.boxplus(gain * points.T_current_previous.boxminus(T_cur_prev));
      covariance -= gain * covariance;
    }
  }
  substitute(from.t, t_imu, T_cur_prev, from, fault);
  // Both the camera's motion and the body's, by the lever arm: R_C of the motion's end, t of its beginning.
  const SE3 T_I_C = filter_->extrinsics(), T_prev_cur = T_cur_prev.inverse(),
            T_I0_I1 = T_I_C * T_prev_cur * T_I_C.inverse();
  // Of T_cur_prev (theta by R exp, t) to that of the body's motion: the turn by -R_I_C, the displacement by
  // -R_prev_cur.
  Matrix6d J = Matrix6d::Zero();
  const Eigen::Matrix3d R_I_C = T_I_C.R();
  J.topLeftCorner<3, 3>() = -T_I0_I1.R().transpose() * R_I_C;
  J.bottomLeftCorner<3, 3>() = R_I_C * hat(T_prev_cur.t());
  J.bottomRightCorner<3, 3>() = -R_I_C * T_prev_cur.R();
  Propagation propagation = filter_->predict(T_I0_I1, J * covariance * J.transpose(), t_imu - from.t);
  propagation.open = fault;
  propagation.refuted = trial_.refuted();
  return propagation;
}

bool MotionSources::admitCutOff(double from, double t_imu, Propagation* propagation) const {
  const double cut_off = inertial_->range().cutOff(from, t_imu);
  if (!(cut_off > 0)) return false;
  propagation->admitRate(cut_off, t_imu - from);
  return true;
}

bool MotionSources::imuIsAtFault(const TrackingResult& tracking, const PredictedMotion& prediction,
                                 const Propagation& propagation) {
  MotionEvidence evidence;
  evidence.disputed = filter_->isDisputed();
  evidence.t = propagation.predicted.t;
  evidence.interval = prediction.interval;
  evidence.images_agree = !prediction.turn_unknown && !prediction.wary && !tracking.moves_by_itself &&
                          tracking.motion.ok && tracking.motion.pairs >= kEnough &&
                          areMismatches(tracking.lost_outlier, tracking.tracked + tracking.lost_outlier);
  if (evidence.images_agree) {
    const Matrix15d P = filter_->covariance();
    Matrix6d covariance = tracking.motion.covariance + motionCovariance(propagation, P, filter_->extrinsics());
    admitMotionError(prediction.T_current_previous, kMotionError, &covariance);
    evidence.turn = logSO3(tracking.motion.T_current_previous.R()).norm();
    evidence.sigmas = motionDifference(tracking.motion.T_current_previous, prediction.T_current_previous, covariance);
    evidence.trial = trial_.add(filter_->window(), P, inertial_->between(filter_->nav().t, evidence.t), tracking.motion,
                                imu_noise_, gravity_);
  } else {
    trial_.reset();
  }
  return faults_.add(evidence);
}

bool MotionSources::bridgesGap(const TrackingResult& tracking, std::size_t tracks_before,
                               const PredictedMotion& prediction) {
  if (!tracking.pose_ok || 2 * static_cast<std::size_t>(tracking.tracked) < tracks_before) return false;
  const SE3 apart = prediction.T_current_previous.inverse() * tracking.T_current_previous;
  return logSO3(apart.R()).norm() < kUsualMotion;
}

void MotionSources::start(double t_imu, bool at_fault) {
  faults_.reset(t_imu, at_fault);
  trial_.reset();
}

void MotionSources::reset() { last_ = SE3(); }

}  // namespace vip_slam::frontend
