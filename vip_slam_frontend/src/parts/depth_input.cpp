// SPDX-License-Identifier: BSD-3-Clause
#include "parts/depth_input.h"

#include <cmath>
#include <utility>

#include "vip_slam_core/depth/disparity_curve.h"

namespace vip_slam::frontend {

DepthInput::DepthInput(const SensorConfig& sensor, std::shared_ptr<const CameraModel> camera)
    : camera_(std::move(camera)),
      given_curve_(sensor.depth_curve),
      given_delay_(sensor.depth_delay),
      given_shift_(sensor.depth_shift),
      focal_(sensor.camera.fx, sensor.camera.fy),
      masked_(sensor.mask.empty() ? cv::Mat() : cv::Mat(sensor.mask == 0)),
      unit_(camera_, sensor.depth_noise) {}

DepthReading DepthInput::read(const cv::Mat& depth, double lag) {
  const double apart = lag - given_delay_ - delay_;
  DepthReading reading{depth, 2 * std::abs(apart) >= kKnotSeconds ? apart : 0.0};
  missing_.look(depth);
  if (missing_.value() > 0) {
    reading.image = depth.clone();
    reading.image.setTo(0, depth == missing_.value());
  }
  if (unit_.factor() != 1) reading.image = reading.image * unit_.factor();
  const DepthCurve curve = chained(given_curve_, curve_);
  const Eigen::Vector2d shift = given_shift_ + shift_.px;
  if (!shift.isZero()) reading.image = shiftedDepth(reading.image, shift);
  // The caller's image must stay unchanged.
  if (reading.image.data == depth.data && (!masked_.empty() || !curve.empty())) reading.image = depth.clone();
  if (!masked_.empty()) reading.image.setTo(0, masked_);
  applyDepthCurve(curve, &reading.image);
  return reading;
}

bool DepthInput::repeats(const cv::Mat& depth, const std::optional<SE3>& T_odom_last) {
  // Depth simulated without noise repeats while the camera stands, so remember the pose of the last new depth image.
  if (T_odom_last && (!same_ || !T_odom_new_)) T_odom_new_ = T_odom_last;
  same_ = !depth.empty() && frozen_.repeats(depth);
  return same_ && T_odom_new_.has_value();
}

bool DepthInput::followUnit(const cv::Mat& gray, const SE3& T_odom_C, double t, DepthReading* depth) {
  const double before = unit_.factor();
  if (!unit_.changes(depth->image, gray, T_odom_C, t)) return false;
  depth->image = depth->image * (unit_.factor() / before);
  return true;
}

bool DepthInput::followDelay(double seconds) { return std::exchange(delay_, seconds) != seconds; }

bool DepthInput::followShift(const Eigen::Vector2d& bearing) {
  if (bearing == shift_.bearing) return false;
  shift_ = {bearing.cwiseProduct(focal_), bearing};
  return true;
}

DepthInput::Change DepthInput::followCurve(const MapUpdate& update) {
  Change change;
  if (update.depth_curve == curve_ || !validateDepthCurve(update.depth_curve).empty()) return change;
  curve_ = update.depth_curve;
  change.curve = true;
  if (voidsDepthOffset(update.disparity_error - disparity_error_)) {
    disparity_error_ = update.disparity_error;
    change.voids_offset = true;
  }
  return change;
}

cv::Mat DepthInput::atStamp(const cv::Mat& depth, const RowPoses& rows) {
  if (!rows_) rows_ = std::make_unique<DepthRows>(camera_);  // most sensors never need its tables
  return rows_->atStamp(depth, rows);
}

void DepthInput::reset() {
  unit_.forget();
  T_odom_new_.reset();
}

}  // namespace vip_slam::frontend
