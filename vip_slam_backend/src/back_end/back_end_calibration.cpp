// SPDX-License-Identifier: BSD-3-Clause
// Applies corrections of camera and gyro estimated by the front end and from the map to all keyframes of the session.
#include <algorithm>
#include <cmath>

#include "back_end_impl.h"
#include "vip_slam_backend/optimisation/depth_curve_fit.h"
#include "vip_slam_backend/optimisation/disparity_fit.h"
#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

// Smaller changes of the camera's correction are adopted only with the next global adjustment.
constexpr double kNewDepthOffset = 0.001;    // m
constexpr double kNewBearing = 1e-4;         // per entry of the matrix, normalised coordinates
constexpr double kNewDepthShift = 0.02;      // px
constexpr std::uint64_t kLeastWait = 4;      // keyframes
constexpr double kNewGyroCorrection = 5e-4;  // per entry of the matrix

}  // namespace

void BackEnd::Impl::followCameraCorrection(const CameraCorrection& newest) {
  if (newest.curve != camera_correction.curve) return;  // it refers to readings with another curve
  newest_correction = newest;
  // The front end's values move with every second of data, the first ones most. An adjustment to new ones is due with
  // half as many keyframes again.
  const std::uint64_t wait = std::max(kLeastWait, keyframes_at_correction / 2);
  if (keyframes_at_correction > 0 && statistics.keyframes_received < keyframes_at_correction + wait) return;
  if (newest.scale == camera_correction.scale && std::abs(newest.offset - camera_correction.offset) < kNewDepthOffset &&
      (newest.bearing.value - camera_correction.bearing.value).cwiseAbs().maxCoeff() < kNewBearing &&
      (newest.shift.px - camera_correction.shift.px).cwiseAbs().maxCoeff() < kNewDepthShift)
    return;
  keyframes_at_correction = statistics.keyframes_received;
  camera_correction = newest;
  map.adoptCameraCorrection(camera_correction);
  global.want();
  global.outdate();  // an adjustment under way has the old readings
}

bool BackEnd::Impl::learnDepthCurve() {
  if (!options.depth_curve || frozen()) return false;
  const ScopedTimer timer(log, "backend.depth_curve", map.empty() ? 0 : map.keyframes().rbegin()->second.data->frame.t);
  std::optional<double> disparity;
  std::optional<DepthCurve> found;
  if (measuresDisparity(sensor.depth_noise.type)) {
    if (!options.disparity) return false;
    disparity = fitDisparityError(map, sensor.depth_noise, disparity_error != 0);
    if (disparity) found = disparityCurve(*disparity, sensor.depth_noise.max_range);
  } else {
    found = fitDepthCurve(map, sensor.depth_noise, !camera_correction.curve.added.empty());
  }
  if (!found) return false;
  DepthCurve curve = chained(camera_correction.curve, *found);
  if (!validateDepthCurve(curve).empty()) return false;
  camera_correction.curve = std::move(curve);
  if (disparity) {
    disparity_error += *disparity;
    if (voidsDepthOffset(*disparity)) camera_correction.offset = newest_correction.offset = 0;
  }
  newest_correction.curve = camera_correction.curve;
  map.adoptCameraCorrection(camera_correction);
  global.outdate();
  return true;
}

void BackEnd::Impl::followGyroCorrection(const Eigen::Matrix3d& newest) {
  newest_gyro_correction = newest;
  if ((newest - gyro_correction).cwiseAbs().maxCoeff() < kNewGyroCorrection) return;
  gyro_correction = newest;
  map.adoptGyroCorrection(newest, sensor.imu_noise);
  global.want();
  global.outdate();  // an adjustment under way has the old IMU factors
}

}  // namespace vip_slam
