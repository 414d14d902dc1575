// Frames in tf, their extrinsics against the sensor file, and all checks together.
#include <map>
#include <optional>
#include <queue>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/words.h"

namespace vip_slam {
namespace {

std::string bare(const std::string& frame) { return !frame.empty() && frame[0] == '/' ? frame.substr(1) : frame; }

/// T_to_from along the tree; none when tf does not connect the two.
std::optional<SE3> connection(const std::vector<TfEdge>& edges, const std::string& to, const std::string& from) {
  std::map<std::string, SE3> reached{{from, SE3()}};  // T_frame_from
  std::queue<std::string> open;
  open.push(from);
  while (!open.empty()) {
    const std::string frame = open.front();
    open.pop();
    if (frame == to) return reached[frame];
    for (const TfEdge& e : edges) {
      const std::string parent = bare(e.parent), child = bare(e.child);
      if (child == frame && !reached.count(parent)) {
        reached[parent] = e.T_parent_child * reached[frame];
        open.push(parent);
      } else if (parent == frame && !reached.count(child)) {
        reached[child] = e.T_parent_child.inverse() * reached[frame];
        open.push(child);
      }
    }
  }
  return std::nullopt;
}

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
  const std::string camera = bare(r.color.frame_id);
  const std::string imu = bare(r.sensor.topics.imu.empty() ? r.gyro.frame_id : r.imu.frame_id);
  if (r.color.stamps.empty() || r.gyro_samples.empty()) return out;
  for (const auto& [role, frame] : {std::make_pair("colour image", camera), std::make_pair("IMU", imu)})
    if (frame.empty())
      out.push_back({Severity::kNote, role, "messages have an empty frame_id",
                     "tf cannot be used for it; the sensor file's extrinsics are"});
  if (camera.empty() || imu.empty()) return out;
  const auto T_imu_cam = connection(r.tf, imu, camera);
  if (!T_imu_cam) {
    const auto known = [&](const std::string& frame) {
      for (const TfEdge& e : r.tf)
        if (bare(e.parent) == frame || bare(e.child) == frame) return true;
      return false;
    };
    std::string missing;
    for (const std::string& frame : {camera, imu})
      if (!known(frame)) missing += (missing.empty() ? "" : " and ") + frame;
    out.push_back({Severity::kNote, "tf",
                   missing.empty() ? imu + " and " + camera + " are not connected" : missing + " not in tf",
                   "the extrinsics of the sensor file are used"});
    return out;
  }
  const SE3 difference = r.sensor.T_imu_cam.inverse() * *T_imu_cam;
  const double angle = difference.rotation().angularDistance(Eigen::Quaterniond::Identity()) * 180 / M_PI;
  const double distance = (T_imu_cam->t() - r.sensor.T_imu_cam.t()).norm();
  if (angle > 3 || distance > 0.02)
    out.push_back({Severity::kWarning, "tf",
                   words("%s to %s differs from the sensor file's T_imu_cam by %.1f degrees and %.1f cm",
                         camera.c_str(), imu.c_str(), angle, 100 * distance),
                   "one of them is wrong; tf is used when the launch file says so"});
  else
    out.push_back({Severity::kGood, "tf",
                   words("camera to IMU as in the sensor file (%.1f degrees, %.1f cm)", angle, 100 * distance), ""});
  if (connection(r.tf, "base_link", imu))
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
