// SPDX-License-Identifier: BSD-3-Clause
#include "adopted_calibration.h"

#include <optional>
#include <utility>

#include "vip_slam_backend/optimisation/depth_curve_fit.h"
#include "vip_slam_backend/optimisation/disparity_fit.h"
#include "vip_slam_core/depth/disparity_curve.h"

namespace vip_slam::backend {

bool AdoptedCalibration::follow(const CameraCorrection& newest, std::uint64_t keyframes, Map* map) {
  if (newest.curve != camera_.curve) return false;  // it refers to readings with another curve
  newest_camera_ = newest;
  if (newest == camera_ || !isDue(keyframes, &keyframes_at_camera_)) return false;
  camera_ = newest;
  map->adoptCameraCorrection(camera_);
  return true;
}

bool AdoptedCalibration::followGyro(const Eigen::Matrix3d& newest, std::uint64_t keyframes, const ImuNoise& noise,
                                    Map* map) {
  newest_gyro_ = newest;
  if (newest == gyro_ || !isDue(keyframes, &keyframes_at_gyro_)) return false;
  gyro_ = newest;
  map->adoptGyroCorrection(newest, noise);
  return true;
}

bool AdoptedCalibration::isDue(std::uint64_t keyframes, std::uint64_t* at_change) {
  if (2 * keyframes < 3 * *at_change) return false;
  *at_change = keyframes;
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
    found = fitDepthCurve(*map, noise);
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
