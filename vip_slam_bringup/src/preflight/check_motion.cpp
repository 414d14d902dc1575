// SPDX-License-Identifier: BSD-3-Clause
// What the motion says of delay, rolling shutter, extrinsics and the IMU (motion_estimate.cpp), as findings.
#include <cmath>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/gyro_integral.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

Finding readoutFinding(const Recording& r, const MotionEstimate& motion) {
  const std::string measured =
      formatted("rows are read within %.1f ms (one sigma %.1f ms), the sensor file says %.1f ms", 1000 * motion.readout,
                1000 * motion.readout_sigma, 1000 * r.sensor.rolling_shutter);
  if (std::abs(motion.readout - r.sensor.rolling_shutter) < std::max(0.003, 4 * motion.readout_sigma))
    return {Severity::kGood, "rolling shutter", measured, ""};
  if (motion.readout < 0)
    return {Severity::kWarning, "rolling shutter", measured, "the last row comes first: is the image turned round?"};
  return {Severity::kWarning, "rolling shutter", measured,
          formatted("set color/rolling_shutter: %.4f in the sensor file", motion.readout)};
}

/// A gyroscope in degrees a second, throughout or for some time: in blocks of half a second, against the images.
std::optional<Finding> degreesFinding(const Recording& r) {
  constexpr double kBlock = 0.5, kTurns = 0.1, kLeast = 30, kMost = 90;  // s, rad/s of the images, times
  constexpr int kSure = 3;                                               // blocks in a row
  const GyroIntegral gyro(r.gyro_samples);
  std::vector<double> ratios;
  double from = 0, to = 0;
  int blocks = 0, run = 0;
  bool sure = false;
  for (std::size_t begin = 0, end = 0; begin < r.rotations.size(); begin = end) {
    const double t = r.rotations[begin].t0;
    double turned = 0, seen = 0, n = 0;
    for (; end < r.rotations.size() && r.rotations[end].t0 < t + kBlock; ++end) {
      const RotationStep& step = r.rotations[end];
      if (!gyro.covers(step.t0) || !gyro.covers(step.t1)) continue;
      turned += ((gyro.at(step.t1) - gyro.at(step.t0)) / (step.t1 - step.t0)).squaredNorm();
      seen += step.rate_C.squaredNorm();
      n += 1;
    }
    end = std::max(end, begin + 1);
    if (seen < n * kTurns * kTurns) continue;
    ++blocks;
    const double ratio = std::sqrt(turned / seen);
    run = ratio > kLeast && ratio < kMost ? run + 1 : 0;
    if (run == 0) continue;
    if (ratios.empty()) from = t;
    to = t + kBlock;
    ratios.push_back(ratio);
    sure = sure || run == kSure;
  }
  if (!sure) return std::nullopt;
  std::string text = formatted("turns %.0f times as fast as the images", upperMedian(ratios));
  if (int(ratios.size()) < blocks)
    text += formatted(" from %.1f to %.1f s", from - r.color.stamps.front(), to - r.color.stamps.front());
  return Finding{Severity::kError, "gyroscope", text, "it reports degrees a second; radians a second are expected"};
}

/// Share of the corners that stand still in the image while the gyro turns the camera by several pixels.
double standingShare(const Recording& r) {
  constexpr double kTurns = 3, kStands = 0.15;  // px, share of that
  const CameraIntrinsics& camera = r.sensor.intrinsics_from_camera_info ? r.color_camera : r.sensor.camera;
  const GyroIntegral gyro(r.gyro_samples);
  double all = 0, standing = 0;
  for (const PixelStep& step : r.pixel_steps) {
    if (!gyro.covers(step.t0) || !gyro.covers(step.t1)) continue;
    const double turn = (gyro.at(step.t1) - gyro.at(step.t0)).norm() * 0.5 * (camera.fx + camera.fy);
    if (turn < kTurns) continue;
    for (const PixelTrack& track : step.tracks) all += 1, standing += (track.to - track.from).norm() < kStands * turn;
  }
  return all > 0 ? standing / all : 0;
}

Finding contradictionFinding(const Recording& r, const MotionEstimate& motion) {
  constexpr double kMany = 0.3;
  const double standing = standingShare(r);
  if (standing > kMany)
    return {Severity::kWarning, "colour image",
            formatted("%.0f %% of its corners stand still while the gyroscope turns", 100 * standing),
            "the projector's dots in an infrared image? switch the emitter off, or take the colour image; else an "
            "overlay, dirt, or a frozen picture"};
  return {Severity::kError, "images and gyroscope",
          formatted("do not turn alike (%.0f %% explained), why is not known", 100 * motion.correlation),
          "are both of one device and clock, is the scene textured and at rest?"};
}

/// The IMU is low-passed: fast turns are smaller than the images say, slow ones are not.
std::optional<Finding> smoothedFinding(const MotionEstimate& motion) {
  constexpr double kLoss = 0.01, kSureOfLoss = 4, kSpoils = 0.03;  // -, sigmas, -
  const double loss = 1 - motion.gain_fast, slow_loss = 1 - motion.gain_slow;
  if (loss < std::max(kLoss, kSureOfLoss * motion.gain_fast_sigma) ||
      std::abs(slow_loss) > std::max(0.5 * loss, 3 * motion.gain_slow_sigma))
    return std::nullopt;
  return Finding{loss > kSpoils ? Severity::kWarning : Severity::kNote, "IMU",
                 formatted("is smoothed: it shows %.1f %% of fast turns (one sigma %.1f) and %.1f %% of slow ones",
                           100 * motion.gain_fast, 100 * motion.gain_fast_sigma, 100 * motion.gain_slow),
                 "raise its rate and the cut-off of its low-pass filter in the driver; scale errors of gyroscope and "
                 "depth that are advised otherwise are not real"};
}

/// How the delay changes: the stamps drift, or, where the halves of the recording are not on one line, step. Empty when
/// one delay holds for all, or when it is not known. `differs`: the delay from the sensor file's.
std::optional<Finding> unsteadyDelay(const Recording& r, const MotionEstimate& motion, bool differs) {
  constexpr double kMatters = 0.004, kSure = 4, kOnLine = 0.002;  // s, sigmas, s
  if (!(motion.drift_sigma > 0)) return std::nullopt;
  const double begin = r.rotations.front().t0, end = r.rotations.back().t1;
  const double span = end - begin, drifted = motion.time_drift * span;
  const bool drifts = std::abs(drifted) > std::max(kMatters, kSure * motion.drift_sigma * span);
  if (!drifts && !differs) return std::nullopt;
  const auto middle = r.rotations.begin() + std::ptrdiff_t(r.rotations.size() / 2);
  const std::vector<RotationStep> halves[] = {{r.rotations.begin(), middle}, {middle, r.rotations.end()}};
  const MotionEstimate first = estimateMotion(r, halves[0]), second = estimateMotion(r, halves[1]);
  if (first.usable && second.usable) {
    const double apart = second.time_offset - first.time_offset;
    const double sigma = std::hypot(first.time_sigma, second.time_sigma);
    const bool line = drifts && std::abs(apart - 0.5 * drifted) < std::max(kOnLine, kSure * sigma);
    if (!line && std::abs(apart) > std::max(kMatters, kSure * sigma))
      return Finding{Severity::kWarning, "camera-IMU delay",
                     formatted("%+.1f ms in the first half, %+.1f ms in the second", 1000 * first.time_offset,
                               1000 * second.time_offset),
                     "the clock of images or IMU steps: stamp both by one clock; no time_offset holds for all"};
  }
  if (!drifts) return std::nullopt;
  return Finding{
      Severity::kWarning, "camera-IMU delay",
      formatted("drifts by %+.0f microseconds a second (one sigma %.0f): %+.1f ms at the beginning, %+.1f ms "
                "at the end",
                1e6 * motion.time_drift, 1e6 * motion.drift_sigma, 1000 * (motion.time_offset - 0.5 * drifted),
                1000 * (motion.time_offset + 0.5 * drifted)),
      formatted("the clock of the images is %s than the IMU's: let the driver stamp both by one clock "
                "(global or system time); no time_offset holds for all",
                motion.time_drift > 0 ? "slower" : "faster")};
}

/// The rotation of given extrinsics against the motion's. Wrong ones are an error where they are what the system uses.
Finding extrinsicsFinding(const Recording& r, const MotionEstimate& motion, const SE3& T_imu_cam, const char* source,
                          bool used) {
  const double angle = T_imu_cam.rotation().angularDistance(motion.R_imu_cam) / kDegree;
  // Without depth a sideways translation looks like a rotation.
  const double most = r.depths.empty() ? 15 : 5;
  if (angle <= most)
    return {Severity::kGood, "extrinsics", formatted("rotation of %s fits the motion (%.1f degrees)", source, angle),
            ""};
  // As it is typed into a sensor file; five decimals are enough to pass there for a rotation.
  const Eigen::Matrix3d R = motion.R_imu_cam.toRotationMatrix();
  const Eigen::Vector3d t = T_imu_cam.t();
  std::string rows;
  for (int i = 0; i < 3; ++i) rows += formatted("[%.5f, %.5f, %.5f, %.5f], ", R(i, 0), R(i, 1), R(i, 2), t(i));
  rows = "[" + rows + "[0, 0, 0, 1]]";
  return {
      used ? Severity::kError : Severity::kWarning, "extrinsics",
      formatted("the motion contradicts %s by %.0f degrees", source, angle),
      used && r.sensor.T_imu_cam.rotation().angularDistance(motion.R_imu_cam) < most * kDegree
          ? "correct it, or use the sensor file's: extrinsics config"
          : std::string(used ? "" : "tf is used unless extrinsics is config; ") + "the motion fits T_imu_cam: " + rows};
}

}  // namespace

Findings checkMotion(const Recording& r) {
  Findings out;
  const MotionEstimate motion = estimateMotion(r, r.rotations);
  if (const auto wrong = cameraFinding(r, motion)) return {*wrong};  // what else the motion says follows from it
  if (const auto degrees = degreesFinding(r)) return {*degrees};     // the same
  if (motion.contradicts) {
    out.push_back(contradictionFinding(r, motion));
    return out;
  }
  if (!motion.usable) {
    out.push_back({Severity::kNote, "camera-IMU delay", "not measured: " + motion.why_not,
                   "turn the sensor about two axes in front of a textured scene"});
    return out;
  }
  if (motion.scale > 5) return out;
  if (const auto cause = inertialFinding(r, motion)) {
    out.push_back(*cause);
    if (cause->severity == Severity::kError) return out;  // what else the motion says follows from it
  }
  if (const auto smoothed = smoothedFinding(motion)) out.push_back(*smoothed);
  const double difference = motion.time_offset - r.sensor.time_offset;
  const std::string measured =
      formatted("%+.1f ms measured (one sigma %.1f ms), the sensor file says %+.1f ms", 1000 * motion.time_offset,
                1000 * motion.time_sigma, 1000 * r.sensor.time_offset);
  const bool differs = std::abs(difference) > std::max(0.006, 3 * motion.time_sigma);
  if (const auto unsteady = unsteadyDelay(r, motion, differs))
    out.push_back(*unsteady);
  else if (differs)
    out.push_back({std::abs(difference) > 0.05 ? Severity::kError : Severity::kWarning, "camera-IMU delay", measured,
                   formatted("set time_offset: %.4f in the sensor file", motion.time_offset)});
  else
    out.push_back({Severity::kGood, "camera-IMU delay", measured, ""});
  if (motion.readout_sigma > 0) out.push_back(readoutFinding(r, motion));
  if (!motion.rotation_known) {
    out.push_back({Severity::kNote, "extrinsics", "not checked: the sensor turns about one axis only", ""});
    return out;
  }
  const std::optional<SE3> of_tf = extrinsicsOfTf(r);
  out.push_back(extrinsicsFinding(r, motion, r.sensor.T_imu_cam, "T_imu_cam", !of_tf));
  if (of_tf) out.push_back(extrinsicsFinding(r, motion, *of_tf, "tf", true));
  return out;
}

}  // namespace vip_slam
