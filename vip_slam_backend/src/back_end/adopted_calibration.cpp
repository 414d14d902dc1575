// SPDX-License-Identifier: BSD-3-Clause
#include "adopted_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "vip_slam_backend/optimisation/depth_curve_fit.h"
#include "vip_slam_backend/optimisation/disparity_fit.h"
#include "vip_slam_core/depth/disparity_curve.h"

namespace vip_slam::backend {
namespace {

// Smaller changes of the camera's correction are adopted only with the next global adjustment.
constexpr double kNewDepthOffset = 0.001;    // m
constexpr double kNewBearing = 1e-4;         // per entry of the matrix, normalised coordinates
constexpr double kNewDepthShift = 0.02;      // px
constexpr std::uint64_t kLeastWait = 4;      // keyframes
constexpr double kNewGyroCorrection = 5e-4;  // per entry of the matrix

}  // namespace

bool AdoptedCalibration::follow(const CameraCorrection& newest, std::uint64_t keyframes, Map* map) {
  if (newest.curve != camera_.curve) return false;  // it refers to readings with another curve
  newest_camera_ = newest;
  // The front end's values move with every second of data, the first ones most. An adjustment to new ones is due with
  // half as many keyframes again.
  const std::uint64_t wait = std::max(kLeastWait, keyframes_at_change_ / 2);
  if (keyframes_at_change_ > 0 && keyframes < keyframes_at_change_ + wait) return false;
  if (newest.scale == camera_.scale && std::abs(newest.offset - camera_.offset) < kNewDepthOffset &&
      (newest.bearing.value - camera_.bearing.value).cwiseAbs().maxCoeff() < kNewBearing &&
      (newest.shift.px - camera_.shift.px).cwiseAbs().maxCoeff() < kNewDepthShift)
    return false;
  keyframes_at_change_ = keyframes;
  camera_ = newest;
  map->adoptCameraCorrection(camera_);
  return true;
}

bool AdoptedCalibration::followGyro(const Eigen::Matrix3d& newest, const ImuNoise& noise, Map* map) {
  newest_gyro_ = newest;
  if ((newest - gyro_).cwiseAbs().maxCoeff() < kNewGyroCorrection) return false;
  gyro_ = newest;
  map->adoptGyroCorrection(newest, noise);
  return true;
}

bool AdoptedCalibration::learnDepthCurve(const DepthNoise& noise, bool disparity, Map* map) {
  std::optional<double> error;
  std::optional<DepthCurve> found;
  if (measuresDisparity(noise.type)) {
    if (!disparity) return false;
    error = fitDisparityError(*map, noise, disparity_error_ != 0);
    if (error) found = disparityCurve(*error, noise.max_range);
  } else {
    found = fitDepthCurve(*map, noise, !camera_.curve.added.empty());
  }
  if (!found) return false;
  DepthCurve curve = chained(camera_.curve, *found);
  if (!validateDepthCurve(curve).empty()) return false;
  camera_.curve = std::move(curve);
  if (error) {
    disparity_error_ += *error;
    if (voidsDepthOffset(*error)) camera_.offset = newest_camera_.offset = 0;
  }
  newest_camera_.curve = camera_.curve;
  map->adoptCameraCorrection(camera_);
  return true;
}

void AdoptedCalibration::adoptNewest(const ImuNoise& noise, Map* map) {
  camera_ = newest_camera_;
  map->adoptCameraCorrection(camera_);
  gyro_ = newest_gyro_;
  map->adoptGyroCorrection(gyro_, noise);
}

}  // namespace vip_slam::backend
