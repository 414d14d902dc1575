// Frames in tf, their extrinsics against the sensor file, and all checks together.
#include <tf2/buffer_core.h>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/words.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {
namespace {

const char* label(Severity severity) {
  switch (severity) {
    case Severity::kGood:
      return "ok     ";
    case Severity::kNote:
      return "note   ";
    case Severity::kWarning:
      return "WARNING";
    case Severity::kError:
      return "ERROR  ";
  }
  return "";
}

const char* paint(Severity severity) {
  switch (severity) {
    case Severity::kGood:
      return "\033[32m";
    case Severity::kNote:
      return "\033[36m";
    case Severity::kWarning:
      return "\033[33m";
    case Severity::kError:
      return "\033[31m";
  }
  return "";
}

}  // namespace

Findings checkTf(const Recording& r) {
  Findings out;
  const std::string camera = bareFrame(r.color.frame_id);
  const std::string imu = bareFrame(r.sensor.topics.imu.empty() ? r.gyro.frame_id : r.imu.frame_id);
  if (r.color.stamps.empty() || r.gyro_samples.empty()) return out;
  for (const auto& [role, frame] : {std::make_pair("colour image", camera), std::make_pair("IMU", imu)})
    if (frame.empty())
      out.push_back({Severity::kNote, role, "messages have an empty frame_id",
                     "tf cannot be used for it; the sensor file's extrinsics are"});
  if (camera.empty() || imu.empty()) return out;
  tf2::BufferCore tf;
  for (const auto& transform : r.tf) tf.setTransform(transform, "recording", true);
  const auto T_imu_cam = lookUpTransform(tf, imu, camera);
  if (!T_imu_cam) {
    std::string missing;
    for (const std::string& frame : {camera, imu})
      if (!tf._frameExists(frame)) missing += (missing.empty() ? "" : " and ") + frame;
    out.push_back({Severity::kNote, "tf",
                   missing.empty() ? imu + " and " + camera + " are not connected" : missing + " not in tf",
                   "the extrinsics of the sensor file are used"});
    return out;
  }
  const MountingGap gap = mountingGap(r.sensor.T_imu_cam, *T_imu_cam);
  if (gap.large())
    out.push_back({Severity::kWarning, "tf",
                   words("%s to %s differs from the sensor file's T_imu_cam by %.1f degrees and %.1f cm",
                         camera.c_str(), imu.c_str(), gap.degrees, 100 * gap.metres),
                   "one of them is wrong; tf is used unless extrinsics is config"});
  else
    out.push_back({Severity::kGood, "tf",
                   words("camera to IMU as in the sensor file (%.1f degrees, %.1f cm)", gap.degrees, 100 * gap.metres),
                   ""});
  if (lookUpTransform(tf, "base_link", imu))
    out.push_back({Severity::kGood, "tf", "IMU is connected to base_link", ""});
  else
    out.push_back(
        {Severity::kNote, "tf", "base_link is not connected to the IMU", "the sensor file's T_base_imu is used"});
  return out;
}

Findings checkAll(const Recording& r) {
  Findings out;
  for (const auto check : {checkTopics, checkRates, checkImages, checkSkew, checkImu}) {
    const Findings found = check(r);
    out.insert(out.end(), found.begin(), found.end());
  }
  const bool motion = !r.color.stamps.empty() && !r.gyro_samples.empty() && r.color_camera_error.empty();
  if (motion) {
    const Findings found = checkMotion(r);
    out.insert(out.end(), found.begin(), found.end());
  }
  const Findings tf = checkTf(r);
  out.insert(out.end(), tf.begin(), tf.end());
  return out;
}

Severity worst(const Findings& findings) {
  Severity out = Severity::kGood;
  for (const Finding& f : findings) out = std::max(out, f.severity);
  return out;
}

std::string toText(const Findings& findings, bool color) {
  std::string out;
  std::size_t errors = 0, warnings = 0;
  for (const Finding& f : findings) {
    errors += f.severity == Severity::kError;
    warnings += f.severity == Severity::kWarning;
    const std::string head = color ? std::string(paint(f.severity)) + label(f.severity) + "\033[0m" : label(f.severity);
    out += head + "  " + f.about + ": " + f.text + "\n";
    if (!f.advice.empty()) out += "           -> " + f.advice + "\n";
  }
  if (errors > 0)
    out += words("Not ready: %zu error%s, %zu warning%s.\n", errors, errors == 1 ? "" : "s", warnings,
                 warnings == 1 ? "" : "s");
  else if (warnings > 0)
    out += words("Ready, with %zu warning%s.\n", warnings, warnings == 1 ? "" : "s");
  else
    out += "Ready.\n";
  return out;
}

}  // namespace vip_slam
