// SPDX-License-Identifier: BSD-3-Clause
// The colour camera's calibration against the motion: readings of it, and whether it stays the same.
#include <cmath>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/image_rotation.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kBetter = 0.6;                            // times the misfit that another reading may have
constexpr double kNoWorse = 1.02;                          // the same, where the rotation tells
constexpr double kFits = 2 * kDegree, kOff = 4 * kDegree;  // rotation of the extrinsics against the motion's

/// As it is to be typed into a sensor file.
std::string cameraText(const CameraIntrinsics& c) {
  std::string distortion;
  for (const double d : c.distortion) distortion += (distortion.empty() ? "" : ", ") + formatted("%.6g", d);
  return formatted(
      "set intrinsics_from_camera_info: false and camera: {width: %d, height: %d, fx: %.6g, fy: %.6g, cx: %.6g, cy: "
      "%.6g, model: %s, distortion: [%s]} in the sensor file",
      c.width, c.height, c.fx, c.fy, c.cx, c.cy, distortionModelName(c.model).c_str(), distortion.c_str());
}

/// How well a reading fits: pixels against the gyro, and the rotation that follows against the configured one.
struct ReadingFit {
  double pixels = 1e9, angle = 1e9;
  bool beats(const ReadingFit& other) const {
    return pixels < kBetter * other.pixels || (pixels < kNoWorse * other.pixels && angle < kFits && other.angle > kOff);
  }
};

ReadingFit fitOf(const Recording& r, const MotionEstimate& motion, const CameraIntrinsics& camera) {
  if (!motion.usable || !(motion.misfit > 0)) return {};
  const SE3 configured = extrinsicsOfTf(r).value_or(r.sensor.T_imu_cam);
  return {motion.misfit * 0.5 * (camera.fx + camera.fy), configured.rotation().angularDistance(motion.R_imu_cam)};
}

}  // namespace

std::optional<Finding> cameraFinding(const Recording& r, const MotionEstimate& motion) {
  const bool of_info = r.sensor.intrinsics_from_camera_info;
  const ReadingFit given = fitOf(r, motion, of_info ? r.color_camera : r.sensor.camera);
  ReadingFit least = given;
  const CameraReading* best = nullptr;
  for (const CameraReading& reading : r.camera_readings) {
    const auto camera = makeCamera(reading.camera);
    std::vector<RotationStep> steps;
    for (const PixelStep& step : r.pixel_steps)
      if (const auto seen = seenBy(*camera, step)) steps.push_back(*seen);
    const ReadingFit other = fitOf(r, estimateMotion(r, steps), reading.camera);
    if (other.beats(given) && other.pixels < kNoWorse * least.pixels) least = other, best = &reading;
  }
  if (!best) return std::nullopt;
  return Finding{Severity::kError, of_info ? "colour camera_info" : "camera",
                 best->what + formatted(": so pixels, depth and gyroscope fit within %.2f px; ", least.pixels) +
                     (given.pixels < 1e9 ? formatted("as it is, they miss by %.2f", given.pixels)
                                         : std::string("as it is, they do not fit at all")),
                 cameraText(best->camera)};
}

}  // namespace vip_slam
