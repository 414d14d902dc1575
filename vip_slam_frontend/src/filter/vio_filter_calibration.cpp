// SPDX-License-Identifier: BSD-3-Clause
// The filter's calibration states (extrinsics, depth, intrinsics, gyro): which values are reported, plausible, kept.
#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam {

namespace {

// One sigma of a number that is not to be learnt: of an offset, m, or of a shift in bearings.
constexpr double kHeldSigma = 1e-6;

}  // namespace

CalibrationEstimate VioFilter::calibration() const {
  CalibrationEstimate calibration = learnt_;
  calibration.depth_offset = depthCorrection();
  calibration.depth_scale = depthScale();
  calibration.depth_delay = depthDelay();
  calibration.readout = readout();
  calibration.bearing = bearingCorrection();
  calibration.depth_contradicts = evidence_.contradicts(kDepthOffset) || shift_contradicts_;
  calibration.depth_shift += depth_shift_;
  if (!started_) return calibration;
  const WindowState& window = filter_.window();
  calibration.depth_shift = depth_shift_ + window.depth_shift;
  calibration.T_I_C = window.T_I_C;
  calibration.time_offset = window.time_offset;
  calibration.sigma_depth_offset = window.calibration.depth_offset ? evidence_.sigmaOfAdopted(kDepthOffset) : 0.0;
  calibration.sigma_depth_scale = window.calibration.depth_scale ? evidence_.sigmaOfAdopted(kDepthScale) : 0.0;
  calibration.sigma_depth_delay = window.calibration.depth_delay ? evidence_.sigmaOfAdopted(kDepthDelay) : 0.0;
  calibration.sigma_readout = window.calibration.readout ? evidence_.sigmaOfAdopted(kReadout) : 0.0;
  for (int k = 0; window.calibration.intrinsics && k < 4; ++k) {
    calibration.sigma_bearing(k) = evidence_.sigmaOfAdopted(kBearing + k);
  }
  calibration.gyro_correction = window.gyro_correction;
  if (window.calibration.size() == 0) return calibration;
  const Eigen::VectorXd sigmas = filter_.calibrationSigmas();
  const int first = window.calibrationColumn();
  if (window.calibration.rotation) calibration.sigma_rotation = sigmas.segment<3>(window.rotationColumn() - first);
  if (window.calibration.translation) {
    calibration.sigma_translation = sigmas.segment<3>(window.translationColumn() - first);
  }
  if (window.calibration.time_offset) calibration.sigma_time_offset = sigmas(window.timeOffsetColumn() - first);
  calibration.delay_drifts = drift_.of(frontend::DriftMonitor::kDelay).drifts();
  if (window.calibration.depth_shift) {
    calibration.sigma_depth_shift = sigmas.segment<2>(window.depthShiftColumn() - first);
  }
  for (int k = 0; k < window.calibration.gyro(); ++k) {
    const auto [row, column] = gyroEntry(window.calibration, k);
    calibration.sigma_gyro_correction(row, column) = sigmas(window.gyroColumn() - first + k);
    calibration.gyro_contradicts = calibration.gyro_contradicts || std::abs(gyroCorrection()(row, column)) >
                                                                       kGateSigmas * imu_noise_.gyro_correction_sigma;
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
  if (change.head<3>().norm() > kGateSigmas * options.sigma_rotation ||
      change.tail<3>().norm() > kGateSigmas * options.sigma_translation ||
      std::abs(window.time_offset - given_.time_offset) > kGateSigmas * options.sigma_time_offset ||
      ((depth_shift + window.depth_shift).array().abs() > kGateSigmas * options.sigma_depth_shift).any() ||
      window.gyro_correction.cwiseAbs().maxCoeff() > kGateSigmas * imu_noise_.gyro_correction_sigma) {
    return;
  }
  learnt_.T_I_C = window.T_I_C;
  learnt_.time_offset = window.time_offset;
  learnt_.depth_shift = window.depth_shift;
  depth_shift_ = depth_shift;
  learnt_.gyro_correction = window.gyro_correction;
}

std::vector<VioFilter::HeldNumber> VioFilter::heldNumbers(WindowState* state) {
  WindowState& window = *state;
  const CalibrationFlags& flags = window.calibration;
  std::vector<HeldNumber> all;
  if (flags.depth_offset) all.push_back({kDepthOffset, &window.depth_offset, false});
  if (flags.depth_scale) all.push_back({kDepthScale, &window.depth_scale, false});
  if (flags.depth_delay) all.push_back({kDepthDelay, &window.depth_delay, true});
  if (flags.readout) all.push_back({kReadout, &window.readout, true});
  for (int k = 0; flags.intrinsics && k < 4; ++k) all.push_back({kBearing + k, &window.bearing.value(k), false});
  return all;
}

void VioFilter::learnHeldNumbers(bool inertial) {
  using frontend::Likelihood;
  const std::vector<HeldNumber> numbers = heldNumbers(&filter_.window());
  if (numbers.empty()) return;
  const int n = static_cast<int>(numbers.size());
  Eigen::VectorXd value(n), before(n);
  Eigen::MatrixXd sigmas = Eigen::MatrixXd::Zero(n, n);
  for (int k = 0; k < n; ++k) {
    const frontend::Estimate held = evidence_.held(numbers[k].index);
    before(k) = held.value;
    value(k) = *numbers[k].state + (numbers[k].applied ? held.value : 0.0);
    sigmas(k, k) = held.sigma;
  }
  const Likelihood of_before = Likelihood::of(before, sigmas * sigmas);
  const Likelihood after = Likelihood::of(value, filter_.covariance(filter_.window().depthOffsetColumn(), n));
  Likelihood step = Likelihood::none(kHeldNumbers);  // numbers that are not estimated have zeros
  for (int j = 0; j < n; ++j) {
    step.weighted(numbers[j].index) = after.weighted(j) - of_before.weighted(j);
    for (int k = 0; k < n; ++k) {
      step.information(numbers[j].index, numbers[k].index) = after.information(j, k) - of_before.information(j, k);
    }
  }
  // Only the IMU knows more than the offset and the readout: a motion that is itself measured by images and depth
  // agrees with any.
  if (!inertial) motion_unmeasured_ = filter_.window().clones.back().t;
  if (motion_unmeasured_ && oldest().t <= *motion_unmeasured_) {
    for (const HeldNumber& number : numbers) {
      if (number.index != kDepthOffset && number.index != kReadout)
        step.marginalise(number.index, evidence_.held(number.index));
    }
  } else {
    motion_unmeasured_.reset();
  }
  evidence_.add(nav().t, step);
  const double delay = depthDelay(), read = readout();
  if (evidence_.adopt()) {
    moveDepth(Eigen::Vector2d::Zero(), depthDelay() - delay);
    for (auto& [id, track] : tracks_) {
      for (Observation& o : track.observations) o.xy += o.by_readout * (readout() - read);
    }
  }
  hold();
}

void VioFilter::hold() {
  const std::vector<HeldNumber> numbers = heldNumbers(&filter_.window());
  if (numbers.empty()) return;
  Eigen::VectorXd change(numbers.size()), sigmas(numbers.size());
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const frontend::Estimate held = evidence_.held(numbers[k].index);
    change(k) = (numbers[k].applied ? 0.0 : held.value) - *numbers[k].state;
    sigmas(k) = held.sigma;
  }
  filter_.replaceMarginal(filter_.window().depthOffsetColumn(), change, sigmas);
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
  if (change.cwiseAbs().maxCoeff() <= kGateSigmas * options_.calibration.sigma_depth_shift) return;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(2, window.dimension());
  H.middleCols<2>(window.depthShiftColumn()).diagonal().setConstant(1.0 / kHeldSigma);
  Eigen::VectorXd r = -change / kHeldSigma;
  filter_.update(H, r);
  moveDepth(-depth_shift_, 0);
  depth_shift_.setZero();
  filter_.window().depth_shift.setZero();
  shift_contradicts_ = true;
  hold();
}

const Eigen::Vector2d& VioFilter::takeDepthShift() {
  if (!started_ || !filter_.window().calibration.depth_shift || shift_contradicts_) return depth_shift_;
  const Eigen::Vector2d rest = filter_.window().depth_shift;
  // The readings of an image share errors, which the filter's sigma does not know.
  const double gate = kGateSigmas * std::sqrt(frontend::CalibrationEvidence::kUsualScatter);
  if (!(rest.array().abs() > gate * calibration().sigma_depth_shift.array()).any()) return depth_shift_;
  moveDepth(rest, 0);
  depth_shift_ += rest;
  filter_.window().depth_shift.setZero();
  return depth_shift_;
}

void VioFilter::restartDepthOffset(bool none) {
  evidence_.restart(kDepthOffset, none ? kHeldSigma : options_.calibration.sigma_depth_offset);
  evidence_.restart(kDepthScale, options_.calibration.sigma_depth_scale);
  for (auto& [id, track] : tracks_) {
    for (Observation& observation : track.observations) observation.depth = 0;
  }
  if (started_) hold();
}

void VioFilter::holdDelay() {
  const WindowState& window = filter_.window();
  filter_.consider(window.timeOffsetColumn(), delay_before_->value - window.time_offset, delay_before_->sigma);
}

Matrix15d VioFilter::covarianceOfScale() const {
  Eigen::Matrix<double, 15, 1> by_scale = Eigen::Matrix<double, 15, 1>::Zero();
  if (started_ && filter_.window().calibration.depth_scale) {
    const NavState state = nav();
    by_scale.segment<3>(3) = state.T_W_I.t() - start_;
    by_scale.segment<3>(6) = state.v_W;
  }
  return evidence_.varianceBeyondHeld(kDepthScale) * by_scale * by_scale.transpose();
}

BearingCorrection VioFilter::bearingCorrection() const {
  BearingCorrection correction;
  for (int k = 0; k < 4; ++k) correction.value(k) = evidence_.adopted(kBearing + k);
  return correction;
}

void VioFilter::judgeGyroCorrection() {
  const WindowState& window = filter_.window();
  if (window.calibration.gyro() == 0) return;
  const Eigen::Array33d change = window.gyro_correction.cwiseAbs();
  const Eigen::Array33d sigma = calibration().sigma_gyro_correction;
  gyro_is_off_ = gyro_is_off_ || (sigma > 0 && change > kGateSigmas * sigma);
}

Eigen::Matrix3d VioFilter::gyroCorrection() const {
  return gyro_is_off_.select(filter_.window().gyro_correction, Eigen::Matrix3d::Zero());
}

}  // namespace vip_slam
