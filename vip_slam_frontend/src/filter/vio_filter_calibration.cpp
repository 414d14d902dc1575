// SPDX-License-Identifier: BSD-3-Clause
// The filter's calibration states (extrinsics, depth, intrinsics, gyro): which values are reported, plausible, kept.
#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam {

namespace {

// An estimate is plausible, and kept over a restart, within this many sigmas of the prior; an entry of the gyro's
// correction within a fixed limit, since its prior sigma is only a data-sheet value.
constexpr double kBelievableChange = 4.0, kMaxGyroError = 0.05;
// A depth offset becomes significant above this many sigmas and metres, and stays so until below half as many metres.
constexpr double kSureOffset = 4.0, kMinOffset = 0.002;
// It must also not change by more than this share of itself within this time, s: an offset that is still growing may
// become implausible, and must not be passed on before.
constexpr double kSteadySeconds = 1.0, kSteadyShare = 0.25;
// One sigma of a depth offset that is reset to its given value, m: holds it there.
constexpr double kHeldOffset = 1e-6;
// Shift of the depth image, in bearings (px over the focal length): significant above kSureShift sigmas, worth
// correcting above kMinShift, known well enough below a sigma of kKnownShift. In an office one pixel of shift raised
// the error from 0.8 to 13 mm.
constexpr double kSureShift = 4.0, kMinShift = 1e-4, kKnownShift = 2e-4;
// One sigma of a shift that is reset to zero, in bearings: holds it there.
constexpr double kHeldShift = 1e-7;
// An entry of the gyro's correction is significant above these: 5e-4 of a rotation by 60 degrees is 0.03 degrees.
constexpr double kSureGyroError = 4.0, kMinGyroError = 5e-4;
// An entry of the bearings' correction (focal lengths, principal point) likewise. Exact focal lengths are estimated
// within 0.03 %, and within 0.1 % when depth has a periodic error.
constexpr double kSureBearing = 4.0;
const Eigen::Array4d kMinBearing(1e-3, 1e-3, 5e-4, 5e-4);

}  // namespace

CalibrationEstimate VioFilter::calibration() const {
  if (!started_) {
    CalibrationEstimate calibration = learnt_;
    calibration.depth_shift += depth_shift_;
    calibration.depth_contradicts = depth_contradicts_ || shift_contradicts_;
    return calibration;
  }
  const WindowState& window = filter_.window();
  CalibrationEstimate calibration;
  calibration.T_I_C = window.T_I_C;
  calibration.time_offset = window.time_offset;
  calibration.depth_offset = window.depth_offset;
  calibration.depth_scale = depth_scale_.adopted();
  calibration.sigma_depth_scale = window.calibration.depth_scale ? depth_scale_.estimate().sigma : 0.0;
  calibration.depth_delay = depth_delay_.adopted();
  calibration.sigma_depth_delay = window.calibration.depth_delay ? depth_delay_.estimate().sigma : 0.0;
  calibration.bearing = window.bearing;
  calibration.depth_shift = depth_shift_ + window.depth_shift;
  calibration.gyro_correction = window.gyro_correction;
  calibration.depth_contradicts = depth_contradicts_ || shift_contradicts_;
  if (window.calibration.size() == 0) return calibration;
  const Eigen::VectorXd sigmas = filter_.calibrationSigmas();
  const int first = window.calibrationColumn();
  if (window.calibration.rotation) calibration.sigma_rotation = sigmas.segment<3>(window.rotationColumn() - first);
  if (window.calibration.translation) {
    calibration.sigma_translation = sigmas.segment<3>(window.translationColumn() - first);
  }
  if (window.calibration.time_offset) calibration.sigma_time_offset = sigmas(window.timeOffsetColumn() - first);
  calibration.delay_drifts = drift_.of(frontend::DriftMonitor::kDelay).drifts();
  if (window.calibration.depth_offset) calibration.sigma_depth_offset = sigmas(window.depthOffsetColumn() - first);
  if (window.calibration.intrinsics) calibration.sigma_bearing = sigmas.segment<4>(window.intrinsicsColumn() - first);
  if (window.calibration.depth_shift) {
    calibration.sigma_depth_shift = sigmas.segment<2>(window.depthShiftColumn() - first);
  }
  for (int k = 0; k < window.calibration.gyro(); ++k) {
    const auto [row, column] = gyroEntry(window.calibration, k);
    calibration.sigma_gyro_correction(row, column) = sigmas(window.gyroColumn() - first + k);
  }
  return calibration;
}

void VioFilter::learnCalibration() {
  const WindowState& window = filter_.window();
  learnt_ = given_;
  const Eigen::Vector2d depth_shift = depth_shift_;
  depth_shift_.setZero();
  if (!window.isFinite()) return;
  const CalibrationOptions& options = options_.calibration;
  const Vector6d change = window.T_I_C.boxminus(given_.T_I_C);
  if (change.head<3>().norm() > kBelievableChange * options.sigma_rotation ||
      change.tail<3>().norm() > kBelievableChange * options.sigma_translation ||
      std::abs(window.time_offset - given_.time_offset) > kBelievableChange * options.sigma_time_offset ||
      std::abs(window.depth_offset - given_.depth_offset) > kBelievableChange * options.sigma_depth_offset ||
      (window.bearing.value.head<2>().array().abs() > kBelievableChange * options.sigma_focal).any() ||
      (window.bearing.value.tail<2>().array().abs() > kBelievableChange * options.sigma_centre).any() ||
      ((depth_shift + window.depth_shift).array().abs() > kBelievableChange * options.sigma_depth_shift).any() ||
      window.gyro_correction.cwiseAbs().maxCoeff() > kMaxGyroError) {
    return;
  }
  learnt_.T_I_C = window.T_I_C;
  learnt_.time_offset = window.time_offset;
  learnt_.depth_offset = window.depth_offset;
  learnt_.bearing = window.bearing;
  learnt_.depth_shift = window.depth_shift;
  depth_shift_ = depth_shift;
  learnt_.gyro_correction = window.gyro_correction;
}

bool VioFilter::isSteady(double depth_offset) {
  const double t = nav().t, since = t - offset_before_.t;
  if (!(since >= 0) || since >= kSteadySeconds) {
    const double moved = std::abs(depth_offset - offset_before_.value);
    offset_is_steady_ = since < 2 * kSteadySeconds && moved < kSteadyShare * std::abs(depth_offset);
    offset_before_ = {t, depth_offset};
  }
  return offset_is_steady_;
}

void VioFilter::learnDepth(bool inertial) {
  const WindowState& window = filter_.window();
  // Only the IMU knows scale and delay: a motion that is itself measured by depth agrees with any.
  if (!inertial) depth_unseen_ = window.clones.back().t;
  const bool counts = !depth_unseen_ || window.clones.front().t > *depth_unseen_;
  if (counts) depth_unseen_.reset();
  const frontend::Estimate scale = depth_scale_.held(), delay = depth_delay_.held();
  const double rest = window.depth_delay;
  if (counts && window.calibration.depth_scale) {
    const double sigma = filter_.sigma(window.depthScaleColumn());
    depth_scale_.add(nav().t, frontend::learntBetween(scale, {window.depth_scale, sigma}));
  }
  if (counts && window.calibration.depth_delay) {
    const double sigma = filter_.sigma(window.depthDelayColumn());
    depth_delay_.add(nav().t, frontend::learntBetween(delay, {delay.value + rest, sigma}));
  }
  if (depth_scale_.adopt()) startDepthOffsetAnew();
  if (depth_delay_.adopt()) {
    moveDepth(Eigen::Vector2d::Zero(), depth_delay_.adopted() - delay.value);
    startDepthOffsetAnew();
  }
  holdDepth();
}

void VioFilter::holdDepth() {
  const WindowState& window = filter_.window();
  if (window.calibration.depth_scale) {
    const frontend::Estimate scale = depth_scale_.held();
    filter_.replaceMarginal(window.depthScaleColumn(), scale.value - window.depth_scale, scale.sigma);
  }
  if (window.calibration.depth_delay) {
    filter_.replaceMarginal(window.depthDelayColumn(), -window.depth_delay, depth_delay_.held().sigma);
  }
}

void VioFilter::judgeDepthOffset() {
  const WindowState& window = filter_.window();
  const double change = window.depth_offset - given_.depth_offset;
  if (!window.calibration.depth_offset || depth_contradicts_) return;
  const bool steady = isSteady(change);
  if (!depth_is_off_ && std::abs(change) > kMinOffset) {
    depth_is_off_ = steady && std::abs(change) > kSureOffset * calibration().sigma_depth_offset;
  } else if (std::abs(change) < kMinOffset / 2) {
    depth_is_off_ = false;
  }
  if (std::abs(change) <= kBelievableChange * options_.calibration.sigma_depth_offset) return;
  // A measurement that the offset has its given value corrects all other states as if it had never been uncertain.
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, window.dimension());
  H(0, window.depthOffsetColumn()) = 1.0 / kHeldOffset;
  Eigen::VectorXd r = Eigen::VectorXd::Constant(1, -change / kHeldOffset);
  filter_.update(H, r);
  depth_contradicts_ = true;
  depth_unseen_ = nav().t;
  depth_is_off_ = false;
}

void VioFilter::moveDepth(const Eigen::Vector2d& shift, double delay) {
  for (auto& [id, track] : tracks_) {
    for (Observation& o : track.observations) {
      if (o.depth > 0) o.depth = std::max(1e-3, o.depth + o.depth_slope.dot(shift) + o.depth_rate * delay);
    }
  }
}

void VioFilter::judgeDepthShift() {
  const WindowState& window = filter_.window();
  if (!window.calibration.depth_shift || shift_contradicts_) return;
  const Eigen::Vector2d change = depth_shift_ + window.depth_shift;
  if (change.cwiseAbs().maxCoeff() <= kBelievableChange * options_.calibration.sigma_depth_shift) return;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, window.dimension());
  H.middleCols<2>(window.depthShiftColumn()).diagonal().setConstant(1.0 / kHeldShift);
  Eigen::VectorXd r = -change / kHeldShift;
  filter_.update(H, r);
  moveDepth(-depth_shift_, 0);
  depth_shift_.setZero();
  filter_.window().depth_shift.setZero();
  shift_contradicts_ = true;
}

const Eigen::Vector2d& VioFilter::takeDepthShift() {
  if (!started_ || !filter_.window().calibration.depth_shift || shift_contradicts_) return depth_shift_;
  const Eigen::Vector2d rest = filter_.window().depth_shift;
  if (rest.cwiseAbs().maxCoeff() < kMinShift) return depth_shift_;
  const Eigen::Vector2d sigma = calibration().sigma_depth_shift;
  const auto off = rest.array().abs();
  if (sigma.maxCoeff() > kKnownShift || !(off > kMinShift && off > kSureShift * sigma.array()).any()) {
    return depth_shift_;
  }
  moveDepth(rest, 0);
  depth_shift_ += rest;
  filter_.window().depth_shift.setZero();
  return depth_shift_;
}

void VioFilter::restartDepthOffset(bool none) {
  sigma_depth_offset_ = none ? kHeldOffset : options_.calibration.sigma_depth_offset;
  learnt_.depth_offset = given_.depth_offset;
  depth_scale_.reset();
  if (started_) holdDepth();
  for (auto& [id, track] : tracks_) {
    for (Observation& observation : track.observations) observation.depth = 0;
  }
  startDepthOffsetAnew();
}

void VioFilter::startDepthOffsetAnew() {
  depth_is_off_ = depth_contradicts_ = false;
  if (!started_ || !filter_.window().calibration.depth_offset) return;
  filter_.renew(filter_.window().depthOffsetColumn(), sigma_depth_offset_);
  filter_.window().depth_offset = given_.depth_offset;
}

void VioFilter::holdDelay() {
  const WindowState& window = filter_.window();
  filter_.consider(window.timeOffsetColumn(), delay_before_->value - window.time_offset, delay_before_->sigma);
}

void VioFilter::judgeIntrinsics() {
  if (!filter_.window().calibration.intrinsics) return;
  const Eigen::Array4d change = filter_.window().bearing.value.array().abs();
  bearing_is_off_ = bearing_is_off_ && change > kMinBearing / 2;
  if ((change > kMinBearing && !bearing_is_off_).any()) {
    bearing_is_off_ =
        bearing_is_off_ || (change > kMinBearing && change > kSureBearing * calibration().sigma_bearing.array());
  }
}

BearingCorrection VioFilter::bearingCorrection() const {
  return {bearing_is_off_.select(filter_.window().bearing.value, Eigen::Vector4d::Zero())};
}

void VioFilter::judgeGyroCorrection() {
  const WindowState& window = filter_.window();
  if (window.calibration.gyro() == 0) return;
  const Eigen::Array33d change = window.gyro_correction.cwiseAbs();
  gyro_is_off_ = gyro_is_off_ && change > kMinGyroError / 2;
  if ((change > kMinGyroError && !gyro_is_off_).any()) {
    gyro_is_off_ = gyro_is_off_ ||
                   (change > kMinGyroError && change > kSureGyroError * calibration().sigma_gyro_correction.array());
  }
}

Eigen::Matrix3d VioFilter::gyroCorrection() const {
  return gyro_is_off_.select(filter_.window().gyro_correction, Eigen::Matrix3d::Zero());
}

}  // namespace vip_slam
