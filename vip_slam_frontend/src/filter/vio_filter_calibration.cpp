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
// One sigma of a depth offset that is not to be learnt, m.
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
    calibration.depth_offset = depth_offset_.adopted();
    calibration.depth_scale = depth_scale_.adopted();
    calibration.depth_delay = depth_delay_.adopted();
    calibration.depth_contradicts = depth_offset_.contradicts() || shift_contradicts_;
    return calibration;
  }
  const WindowState& window = filter_.window();
  CalibrationEstimate calibration;
  calibration.T_I_C = window.T_I_C;
  calibration.time_offset = window.time_offset;
  calibration.depth_offset = depth_offset_.adopted();
  calibration.sigma_depth_offset = window.calibration.depth_offset ? depth_offset_.estimate().sigma : 0.0;
  calibration.depth_scale = depth_scale_.adopted();
  calibration.sigma_depth_scale = window.calibration.depth_scale ? depth_scale_.estimate().sigma : 0.0;
  calibration.depth_delay = depth_delay_.adopted();
  calibration.sigma_depth_delay = window.calibration.depth_delay ? depth_delay_.estimate().sigma : 0.0;
  calibration.bearing = window.bearing;
  calibration.depth_shift = depth_shift_ + window.depth_shift;
  calibration.gyro_correction = window.gyro_correction;
  calibration.depth_contradicts = depth_offset_.contradicts() || shift_contradicts_;
  if (window.calibration.size() == 0) return calibration;
  const Eigen::VectorXd sigmas = filter_.calibrationSigmas();
  const int first = window.calibrationColumn();
  if (window.calibration.rotation) calibration.sigma_rotation = sigmas.segment<3>(window.rotationColumn() - first);
  if (window.calibration.translation) {
    calibration.sigma_translation = sigmas.segment<3>(window.translationColumn() - first);
  }
  if (window.calibration.time_offset) calibration.sigma_time_offset = sigmas(window.timeOffsetColumn() - first);
  calibration.delay_drifts = drift_.of(frontend::DriftMonitor::kDelay).drifts();
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
      (window.bearing.value.head<2>().array().abs() > kBelievableChange * options.sigma_focal).any() ||
      (window.bearing.value.tail<2>().array().abs() > kBelievableChange * options.sigma_centre).any() ||
      ((depth_shift + window.depth_shift).array().abs() > kBelievableChange * options.sigma_depth_shift).any() ||
      window.gyro_correction.cwiseAbs().maxCoeff() > kMaxGyroError) {
    return;
  }
  learnt_.T_I_C = window.T_I_C;
  learnt_.time_offset = window.time_offset;
  learnt_.bearing = window.bearing;
  learnt_.depth_shift = window.depth_shift;
  depth_shift_ = depth_shift;
  learnt_.gyro_correction = window.gyro_correction;
}

void VioFilter::learnDepth(bool inertial) {
  using frontend::learntBetween;
  const WindowState& window = filter_.window();
  // Only the IMU knows scale and delay: a motion that is itself measured by depth agrees with any.
  if (!inertial) depth_unseen_ = window.clones.back().t;
  const bool counts = !depth_unseen_ || window.clones.front().t > *depth_unseen_;
  if (counts) depth_unseen_.reset();
  if (window.calibration.depth_offset) {
    const double sigma = filter_.sigma(window.depthOffsetColumn());
    depth_offset_.add(nav().t, learntBetween(depth_offset_.held(), {window.depth_offset, sigma}));
  }
  if (counts && window.calibration.depth_scale) {
    const double sigma = filter_.sigma(window.depthScaleColumn());
    depth_scale_.add(nav().t, learntBetween(depth_scale_.held(), {window.depth_scale, sigma}));
  }
  const frontend::Estimate delay = depth_delay_.held();
  if (counts && window.calibration.depth_delay) {
    const double sigma = filter_.sigma(window.depthDelayColumn());
    depth_delay_.add(nav().t, learntBetween(delay, {delay.value + window.depth_delay, sigma}));
  }
  const bool scaled = depth_scale_.adopt(), delayed = depth_delay_.adopt();
  if (delayed) moveDepth(Eigen::Vector2d::Zero(), depth_delay_.adopted() - delay.value);
  // Of another scale or moment a part had been taken for the offset.
  if (scaled || delayed) depth_offset_.reset();
  depth_offset_.adopt();
  holdDepth();
}

void VioFilter::holdDepth() {
  const WindowState& window = filter_.window();
  Eigen::VectorXd change(3), sigmas(3);
  int states = 0;
  const auto hold = [&](double by, const frontend::Estimate& held) {
    change(states) = by;
    sigmas(states++) = held.sigma;
  };
  if (window.calibration.depth_offset) hold(depth_offset_.adopted() - window.depth_offset, depth_offset_.held());
  if (window.calibration.depth_scale) hold(depth_scale_.adopted() - window.depth_scale, depth_scale_.held());
  if (window.calibration.depth_delay) hold(-window.depth_delay, depth_delay_.held());
  if (states > 0) filter_.replaceMarginal(window.depthOffsetColumn(), change.head(states), sigmas.head(states));
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
  depth_offset_ = frontend::CalibrationEvidence({0.0, none ? kHeldOffset : options_.calibration.sigma_depth_offset});
  depth_scale_.reset();
  for (auto& [id, track] : tracks_) {
    for (Observation& observation : track.observations) observation.depth = 0;
  }
  if (started_) holdDepth();
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
