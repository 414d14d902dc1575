// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/vio_filter.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

namespace {

/// Squared correction of orientation and velocity per degree of freedom, whitened by the decrease of the covariance.
double correctionPerDof(const NavState& before, const Matrix15d& P_before, const NavState& after,
                        const Matrix15d& P_after) {
  Vector6d d;
  d << logSO3(Eigen::Matrix3d(before.T_W_I.R().transpose() * after.T_W_I.R())), after.v_W - before.v_W;
  Matrix6d S;
  const Matrix15d lost = P_before - P_after;
  S << lost.block<3, 3>(0, 0), lost.block<3, 3>(0, 6), lost.block<3, 3>(6, 0), lost.block<3, 3>(6, 6);
  return d.dot(S.ldlt().solve(d)) / 6.0;
}

}  // namespace

VioFilter::VioFilter(const FilterOptions& options, const ImuNoise& imu_noise, const SE3& T_I_C, double time_offset,
                     double focal_px, double gravity)
    : options_(options),
      imu_noise_(imu_noise),
      given_{T_I_C, time_offset},
      learnt_(given_),
      evidence_({{0.0, options.calibration.sigma_depth_offset},
                 {1.0, options.calibration.sigma_depth_scale},
                 {0.0, options.calibration.sigma_depth_delay},
                 {0.0, options.calibration.sigma_readout},
                 {0.0, options.calibration.sigma_focal},
                 {0.0, options.calibration.sigma_focal},
                 {0.0, options.calibration.sigma_centre},
                 {0.0, options.calibration.sigma_centre}}),
      focal_(focal_px),
      G_(gravityVector(gravity)),
      gate_(kGateProbability),
      noise_(options.sigma_px, options.sigma_px_min),
      depth_noise_(1.0, 1.0),
      imu_monitor_(options.adapt_imu_noise),
      drift_(imu_noise, options) {
  evidence_.couple(kBearing, kBearing + 1, options.calibration.sigma_aspect);  // pixels are nearly square
}

void VioFilter::stop() {
  if (started_) learnCalibration();
  started_ = false;
  tracks_.clear();
  imu_monitor_.reset();
  drift_.reset();
  disputed_.reset();
  still_images_ = 0;
  after_open_ = false;
  motion_unmeasured_.reset();
  delay_before_.reset();
  mark_ = 0;
  mark_kept_ = false;
}

void VioFilter::start(const FilterPrior& prior, CloneId id, const Eigen::Vector3d& omega_I) {
  stop();
  start_ = prior.state.T_W_I.t();
  WindowState window;
  Clone clone;
  clone.id = id;
  clone.t = prior.state.t;
  clone.T_W_I = clone.T_W_I_fej = prior.state.T_W_I;
  clone.omega_I = omega_I;
  clone.v_W = prior.state.v_W;
  clone.time_offset = learnt_.time_offset;
  window.clones.push_back(clone);
  window.v_W = window.v_W_fej = prior.state.v_W;
  window.bias_gyro = prior.state.bias_gyro;
  window.bias_accel = prior.state.bias_accel;
  window.T_I_C = learnt_.T_I_C;
  window.time_offset = learnt_.time_offset;
  window.depth_offset = depthCorrection();
  window.depth_scale = depthScale();
  window.bearing = bearingCorrection();
  window.depth_shift = learnt_.depth_shift;
  window.gyro_correction = learnt_.gyro_correction;
  const CalibrationOptions& calibration = options_.calibration;
  window.calibration = {
      calibration.rotation,     calibration.translation,      calibration.time_offset,
      calibration.depth_offset, calibration.depth_scale,      calibration.depth_delay,
      calibration.readout,      calibration.intrinsics,       calibration.depth_shift && !shift_contradicts_,
      calibration.gyro_scale,   calibration.gyro_misalignment};

  const int n = window.dimension(), nav = window.navColumn();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n + 3, n);
  const auto known = [&rows](int column, int size, double sigma) {
    rows.diagonal().segment(column, size).setConstant(1.0 / sigma);
  };
  const Eigen::Vector3d sigma_rotation(prior.sigma_tilt, prior.sigma_tilt, prior.sigma_yaw);
  rows.block<3, 3>(0, 0) = sigma_rotation.cwiseInverse().asDiagonal() * prior.state.T_W_I.R();
  known(3, 3, prior.sigma_position);
  if (window.calibration.rotation) known(window.rotationColumn(), 3, calibration.sigma_rotation);
  if (window.calibration.translation) known(window.translationColumn(), 3, calibration.sigma_translation);
  if (window.calibration.time_offset) known(window.timeOffsetColumn(), 1, calibration.sigma_time_offset);
  if (window.calibration.depth_shift) known(window.depthShiftColumn(), 2, calibration.sigma_depth_shift);
  known(window.gyroColumn(), window.calibration.gyro(), imu_noise_.gyro_correction_sigma);
  int column = window.depthOffsetColumn();
  for (const HeldNumber& number : heldNumbers(&window)) known(column++, 1, evidence_.held(number.index).sigma);
  known(nav, 3, prior.sigma_velocity);
  known(nav + 3, 3, prior.sigma_bias_gyro);
  known(nav + 6, 3, prior.sigma_bias_accel);
  if (prior.standing) {
    // mean = b_a + R^T G. The state was levelled with this mean, so the residual is zero.
    const Eigen::Vector3d up_I = prior.state.T_W_I.R().transpose() * G_;
    const double w = 1.0 / prior.sigma_mean_accel;
    rows.block<3, 3>(n, 0) = w * hat(up_I);
    rows.block<3, 3>(n, nav + 6) = w * Eigen::Matrix3d::Identity();
  }
  filter_.initialise(window, rows);
  started_ = true;
}

ImuNoiseScale VioFilter::imuNoise() const {
  using Drift = frontend::DriftMonitor;
  return {imu_monitor_.scale(), drift_.of(Drift::kGyroBias).factor(), drift_.of(Drift::kAccelBias).factor()};
}

Propagation VioFilter::predict(const SE3& T_I0_I1, const Matrix6d& covariance, double dt) const {
  return propagateByMotion(filter_.window(), T_I0_I1, covariance, dt, imu_noise_);
}

Propagation VioFilter::predict(const std::vector<ImuSample>& samples, const frontend::ChannelNoise& noise) const {
  ImuNoise found = scaled(imu_noise_, imuNoise());
  found.gyro_noise_density *= noise.gyro;
  found.accel_noise_density *= noise.accel;
  return propagate(filter_.window(), samples, found, G_);
}

void VioFilter::forgetClone(CloneId id) {
  for (auto it = tracks_.begin(); it != tracks_.end();) {
    auto& observations = it->second.observations;
    observations.erase(
        std::remove_if(observations.begin(), observations.end(), [id](const Observation& o) { return o.clone == id; }),
        observations.end());
    it = observations.empty() ? tracks_.erase(it) : std::next(it);
  }
}

void VioFilter::admitDispute() {
  const Eigen::VectorXd sigmas = disputed_.take().cwiseSqrt();
  const WindowState& window = filter_.window();
  const Eigen::Vector3d newest = window.clones.back().T_W_I_fej.t();
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(window.dimension(), 6);
  for (int i = 0; i < static_cast<int>(window.clones.size()); ++i) {
    if (mark_kept_ && window.clones[i].id == mark_) continue;
    const SE3& T_W_I = window.clones[i].T_W_I_fej;
    auto of_clone = N.middleRows<6>(window.cloneColumn(i));
    of_clone.topLeftCorner<3, 3>() = T_W_I.R().transpose();
    of_clone.bottomLeftCorner<3, 3>() = -hat(T_W_I.t() - newest);
    of_clone.bottomRightCorner<3, 3>().setIdentity();
  }
  N.block<3, 3>(window.navColumn(), 0) = -hat(window.v_W_fej);
  filter_.inflate(N * sigmas.asDiagonal());
}

void VioFilter::admitRefuted(const RefutedMotion& refuted) {
  const WindowState& window = filter_.window();
  const int clones = static_cast<int>(window.clones.size());
  const double begin = window.clones.back().t - refuted.seconds;
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(window.dimension(), 6 * clones);
  for (int i = 0; i < clones; ++i) {
    const double from = i > 0 ? std::max(begin, window.clones[i - 1].t) : begin;
    if (window.clones[i].t <= from) continue;
    const double share = std::sqrt((window.clones[i].t - from) / refuted.seconds);
    const Eigen::Vector3d pivot = window.clones[std::max(0, i - 1)].T_W_I_fej.t();
    Vector6d sigmas;
    sigmas << Eigen::Vector3d::Constant(share * refuted.turn), Eigen::Vector3d::Constant(share * refuted.displacement);
    auto by_interval = N.middleCols<6>(6 * i);
    for (int k = i; k < clones; ++k) {
      const SE3& T_W_I = window.clones[k].T_W_I_fej;
      auto of_clone = by_interval.middleRows<6>(window.cloneColumn(k));
      of_clone.topLeftCorner<3, 3>() = T_W_I.R().transpose();
      of_clone.bottomLeftCorner<3, 3>() = -hat(T_W_I.t() - pivot);
      of_clone.bottomRightCorner<3, 3>().setIdentity();
    }
    by_interval.middleRows<3>(window.navColumn()).leftCols<3>() = -hat(window.v_W_fej);
    by_interval = by_interval * sigmas.asDiagonal();
  }
  filter_.inflate(N);
}

Matrix15d VioFilter::covarianceOfVertical() const {
  const NavState state = nav();
  Eigen::Matrix<double, 15, 3> by_turn = Eigen::Matrix<double, 15, 3>::Zero();
  by_turn.topRows<3>() = state.T_W_I.R().transpose();
  by_turn.middleRows<3>(3) = -hat(state.T_W_I.t() - start_);
  by_turn.middleRows<3>(6) = -hat(state.v_W);
  return by_turn.leftCols<2>() * by_turn.leftCols<2>().transpose();
}

void VioFilter::noteCorrection(const NavState& predicted, const Matrix15d& removed) {
  const Eigen::Matrix3d R_W_I = predicted.T_W_I.R();
  const Vector6d corrected = nav().T_W_I.boxminus(predicted.T_W_I);
  Vector6d correction, variance;
  correction << R_W_I * corrected.head<3>(), corrected.tail<3>();
  variance << (R_W_I * removed.topLeftCorner<3, 3>() * R_W_I.transpose()).diagonal(), removed.diagonal().segment<3>(3);
  disputed_.add(predicted.t, correction, variance);
}

void VioFilter::markNewest() {
  if (mark_kept_) filter_.marginalise({filter_.window().indexOf(mark_)});
  mark_kept_ = false;
  mark_ = filter_.window().clones.back().id;
}

const Clone& VioFilter::oldest() const {
  const std::vector<Clone>& clones = filter_.window().clones;
  return clones[mark_kept_ && clones.front().id == mark_ ? 1 : 0];
}

RelativeMotion VioFilter::motionSinceMark() const {
  const int mark = filter_.window().indexOf(mark_), newest = static_cast<int>(filter_.window().clones.size()) - 1;
  return mark < 0 || mark == newest ? RelativeMotion{} : filter_.relativeMotion(mark, newest);
}

std::optional<SE3> VioFilter::poseSinceMark() const {
  const int mark = filter_.window().indexOf(mark_);
  if (mark < 0) return std::nullopt;
  const auto& clones = filter_.window().clones;
  return clones[mark].T_W_I.inverse() * clones.back().T_W_I;
}

void VioFilter::addMeasurements(CloneId id, const std::vector<FilterMeasurement>& measurements) {
  for (const FilterMeasurement& m : measurements) {
    FilterTrack& track = tracks_[m.id];
    track.id = m.id;
    track.observations.push_back({id, m.xy, m.depth, m.depth_sigma, m.depth_slope, m.depth_rate, m.by_intrinsics,
                                  m.by_readout, m.whitening, m.depth_shared});
  }
}

void VioFilter::updateWithSurfaces(const SurfaceMatches& surfaces, StepReport* report) {
  SurfaceRows surface = surfaceRows(filter_.window(), filter_.R(), surfaces, kHuberSigmas);
  report->surfaces_used = surface.used;
  const int dof = static_cast<int>(surface.rows.r.size());
  if (dof == 0) return;
  const UpdateResult result = filter_.update(surface.rows.H, surface.rows.r);
  report->healthy = report->healthy && result.ok;
}

StepReport VioFilter::step(const Propagation& propagation, CloneId id,
                           const std::vector<FilterMeasurement>& measurements,
                           std::optional<ResidualMotion> residual_motion, const SurfaceMatches* surfaces) {
  StepReport report;
  const bool still = residual_motion.has_value();
  const CloneId previous = filter_.window().clones.back().id;
  if (!filter_.window().calibration.time_offset || propagation.rates.changes()) {
    delay_before_.reset();
  } else if (!delay_before_) {
    delay_before_ = delay();
  }
  // While the delay is held it neither drifts nor is estimated.
  const double since = propagation.predicted.t - filter_.window().clones.back().t;
  const double delay_change =
      delay_before_ ? 0.0 : drift_.of(frontend::DriftMonitor::kDelay).density() * std::sqrt(since);
  const bool opens = propagation.open && !after_open_, refuted = opens && propagation.refuted.turn > 0;
  if (opens) admitDispute();
  if (refuted) admitRefuted(propagation.refuted);
  filter_.augment(propagation, id, delay_change);

  // From the second still image on, the newest clone replaces the one before: the window keeps what it knew of the
  // motion and does not fill with copies of one pose.
  const bool replace = still && still_images_ > 0;
  if (replace && previous != still_anchor_) {
    mark_kept_ = mark_kept_ || previous == mark_;
    if (previous != mark_) filter_.marginalise({static_cast<int>(filter_.window().clones.size()) - 2});
    forgetClone(previous);
  }
  addMeasurements(id, measurements);

  if (still) {
    if (still_images_ == 0) still_anchor_ = id;
    Eigen::MatrixXd H;
    Eigen::VectorXd h;
    zeroVelocityRows(filter_.window(), filter_.window().indexOf(still_anchor_), since, *residual_motion, &H, &h);
    const UpdateResult result = filter_.update(H, h);
    report.zero_velocity = true;
    report.healthy = result.ok;
    ++still_images_;
  } else {
    still_images_ = 0;
  }

  const NavState predicted = nav();
  const Matrix15d P_predicted = covariance();
  const frontend::Estimate delay_predicted = filter_.window().calibration.time_offset ? delay() : frontend::Estimate{};
  const bool window_full = static_cast<int>(filter_.window().clones.size()) - (mark_kept_ ? 1 : 0) > options_.window;
  // After an interval that left the motion open only images can measure the velocity, and after an inflation the
  // motion: the first image after it updates with all tracks.
  const bool all = refuted || (after_open_ && !propagation.open);
  after_open_ = propagation.open;
  const std::vector<Candidate> candidates = chooseCandidates(id, window_full, all);
  if (!candidates.empty()) updateWithFeatures(candidates, all, &report);
  if (surfaces && !still) updateWithSurfaces(*surfaces, &report);
  if (delay_before_) {
    holdDelay();
  } else if (filter_.window().calibration.time_offset && !still) {
    const auto one = [](double value) { return Eigen::VectorXd::Constant(1, value); };
    const frontend::Estimate found = delay();
    drift_.add(frontend::DriftMonitor::kDelay, one(found.value - delay_predicted.value),
               one(std::pow(delay_predicted.sigma, 2)), one(std::pow(found.sigma, 2)));
  }
  learnHeldNumbers(propagation.inertial && !still);
  judgeDepthShift();
  judgeGyroCorrection();
  const Matrix15d P_updated = covariance();
  if (!still) {
    noteCorrection(predicted, P_predicted - P_updated);
    report.disputed = disputed_.isSignificant();
    if (report.disputed) admitDispute();
  }
  report.correction = correctionPerDof(predicted, P_predicted, nav(), P_updated);
  if (!still) {
    if (propagation.inertial) {
      using Drift = frontend::DriftMonitor;
      const Eigen::Matrix<double, 15, 1> before = P_predicted.diagonal(), after = P_updated.diagonal();
      drift_.add(Drift::kGyroBias, nav().bias_gyro - predicted.bias_gyro, before.segment<3>(9), after.segment<3>(9));
      drift_.add(Drift::kAccelBias, nav().bias_accel - predicted.bias_accel, before.tail<3>(), after.tail<3>());
    }
    drift_.endImage(nav().t);
    imu_monitor_.add(report.correction, report.features_used + report.features_gated);
  }

  // Observations must not be used twice: lost and used tracks are deleted, and restart with the next image.
  const int used = std::min<int>(report.features_tried, static_cast<int>(candidates.size()));
  std::vector<LandmarkId> gone;
  for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
    if (candidates[i].lost || i < used) gone.push_back(candidates[i].track->id);
  }
  for (LandmarkId track : gone) tracks_.erase(track);
  for (auto it = tracks_.begin(); it != tracks_.end();) {
    it = it->second.observations.back().clone != id ? tracks_.erase(it) : std::next(it);
  }
  if (window_full) {
    const CloneId leaving = oldest().id;
    mark_kept_ = mark_kept_ || leaving == mark_;
    if (leaving != mark_) filter_.marginalise({filter_.window().indexOf(leaving)});
    forgetClone(leaving);
  }
  report.healthy = report.healthy && filter_.healthy();
  return report;
}

}  // namespace vip_slam
