// SPDX-License-Identifier: BSD-3-Clause
// Frames in tf, and their extrinsics against the sensor file.
#include <tf2/buffer_core.h>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/input_options.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {
namespace {

struct Frames {
  std::string camera, imu;
};

Frames framesOf(const Recording& r) {
  const SensorTopics& topics = r.sensor.topics;
  const StreamRecord& inertial = !topics.imu.empty() ? r.imu : !topics.gyro.empty() ? r.gyro : r.accel;
  return {bareFrame(r.color.frame_id), bareFrame(inertial.frame_id)};
}

void fill(const Recording& r, tf2::BufferCore* tf) {
  for (const auto& transform : r.tf) tf->setTransform(transform, "recording", true);
}

}  // namespace

std::optional<SE3> extrinsicsOfTf(const Recording& r) {
  const Frames frames = framesOf(r);
  if (frames.camera.empty() || frames.imu.empty() || frames.camera == frames.imu) return std::nullopt;
  tf2::BufferCore tf;
  fill(r, &tf);
  return lookUpExtrinsics(tf, frames.imu, frames.camera);
}

Findings checkTf(const Recording& r) {
  Findings out;
  if (r.sensor.topics.hasInertial()) {
    const std::optional<SE3> of_tf = extrinsicsOfTf(r);
    const std::string wrong = leverArmProblem(of_tf.value_or(r.sensor.T_imu_cam), InputOptions().max_lever_arm);
    if (!wrong.empty())
      out.push_back({Severity::kError, "extrinsics", std::string(of_tf ? "tf: " : "T_imu_cam: ") + wrong, ""});
  }
  const auto [camera, imu] = framesOf(r);
  if (r.color.stamps.empty()) return out;
  if (!r.sensor.topics.hasInertial()) {
    if (camera.empty()) return out;
    tf2::BufferCore tf;
    fill(r, &tf);
    if (lookUpTransform(tf, "base_link", camera))
      out.push_back({Severity::kGood, "tf", "the camera is connected to base_link", ""});
    else
      out.push_back(
          {Severity::kNote, "tf", "base_link is not connected to the camera", "the sensor file's T_base_imu is used"});
    return out;
  }
  if (r.gyro_samples.empty() && r.accel_samples.empty()) return out;
  for (const auto& [role, frame] : {std::make_pair("colour image", camera), std::make_pair("IMU", imu)})
    if (frame.empty())
      out.push_back({Severity::kNote, role, "messages have an empty frame_id",
                     "tf cannot be used for it; the sensor file's extrinsics are"});
  if (camera.empty() || imu.empty()) return out;
  if (camera == imu) {
    out.push_back({Severity::kNote, "tf", "image and IMU name the same frame, " + camera,
                   "tf cannot tell where they are; the extrinsics of the sensor file are used"});
    return out;
  }
  tf2::BufferCore tf;
  fill(r, &tf);
  const auto T_imu_cam = lookUpExtrinsics(tf, imu, camera);
  if (!T_imu_cam) {
    std::string missing;
    for (const std::string& frame : {camera, imu})
      if (!tf._frameExists(frame)) missing += (missing.empty() ? "" : " and ") + frame;
    out.push_back({Severity::kNote, "tf",
                   missing.empty() ? imu + " and " + camera + " are not connected" : missing + " not in tf",
                   "the extrinsics of the sensor file are used"});
    return out;
  }
  const ExtrinsicsGap gap = extrinsicsGap(r.sensor.T_imu_cam, *T_imu_cam);
  if (gap.large())
    out.push_back({Severity::kWarning, "tf",
                   formatted("%s to %s differs from the sensor file's T_imu_cam by %.1f degrees and %.1f cm",
                             camera.c_str(), imu.c_str(), gap.degrees, 100 * gap.metres),
                   "one of them is wrong; tf is used unless extrinsics is config"});
  else
    out.push_back(
        {Severity::kGood, "tf",
         formatted("camera to IMU as in the sensor file (%.1f degrees, %.1f cm)", gap.degrees, 100 * gap.metres), ""});
  if (lookUpTransform(tf, "base_link", imu))
    out.push_back({Severity::kGood, "tf", "IMU is connected to base_link", ""});
  else
    out.push_back(
        {Severity::kNote, "tf", "base_link is not connected to the IMU", "the sensor file's T_base_imu is used"});
  return out;
}

}  // namespace vip_slam
