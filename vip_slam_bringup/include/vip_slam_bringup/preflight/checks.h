// SPDX-License-Identifier: BSD-3-Clause
// The preflight checks: each tests one aspect of a recording and reports its findings in plain words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vip_slam_bringup/preflight/inertial_motion.h"
#include "vip_slam_bringup/preflight/recording.h"

namespace vip_slam {

/// Jitter of image stamps that is reported, s: at 60 degrees/s the camera rotates by a milliradian, half a pixel, in 1
/// ms.
constexpr double kLargeStampJitter = 0.001;

enum class Severity {
  kGood,     ///< as it should be
  kNote,     ///< worth knowing
  kWarning,  ///< works worse than it could
  kError     ///< will not work
};

struct Finding {
  Severity severity = Severity::kGood;
  std::string about;   ///< topic or quantity
  std::string text;    ///< what was found
  std::string advice;  ///< what to do; empty when all is well
};
using Findings = std::vector<Finding>;

Findings checkTopics(const Recording& recording);  ///< topics exist, have the right type, have messages
Findings checkRates(const Recording& recording);   ///< rates, missing messages, order of stamps, stamps against clock
Findings checkImages(const Recording& recording);  ///< encodings, sizes, camera_info, depth values
Findings checkDepthGeometry(const Recording& recording);  ///< depth with or without the lens of the colour camera
Findings checkSkew(const Recording& recording);           ///< colour against depth stamps
Findings checkImu(const Recording& recording);            ///< gaps, units, gravity, values that never change
Findings checkShaking(const Recording& recording);        ///< what the IMU measures while the images stand still
Findings checkMotion(const Recording& recording);         ///< camera-IMU delay and rotation from the motion itself
Findings checkTf(const Recording& recording);             ///< frames, and extrinsics against the sensor file

/// T_imu_cam of the recording's tf, which the system prefers to the sensor file's; empty when tf does not have it.
std::optional<SE3> extrinsicsOfTf(const Recording& recording);

/// All of them in this order; the later ones only when their input is available.
Findings checkAll(const Recording& recording);
Severity worst(const Findings& findings);
/// One line per finding in the order given, then the verdict; `color`: ANSI colours.
std::string toText(const Findings& findings, bool color);

/// Camera-IMU delay and rotation estimated from gyro rates and image rotation.
struct MotionEstimate {
  bool usable = false;
  std::string why_not;     ///< reason when not usable
  double time_offset = 0;  ///< seconds; t_imu = t_image + time_offset, in the middle of the recording
  double time_sigma = 0;   ///< one sigma of it, seconds
  double time_drift = 0;   ///< seconds a second by which it grows
  double drift_sigma = 0;  ///< one sigma of that; 0: not known
  Eigen::Quaterniond R_imu_cam = Eigen::Quaterniond::Identity();
  bool rotation_known = false;  ///< rotated about two axes at least
  double correlation = 0;       ///< share of the gyro's variance that the images explain, 0..1
  double scale = 1;             ///< gyro rate over image rate
  double readout = 0;           ///< seconds from the first row of an image to its last
  double readout_sigma = 0;     ///< one sigma of it; 0: not known
  bool contradicts = false;     ///< not usable since images and gyro turn differently
  /// Gyro rate over image rate, and one sigma of it (0: not known): of turns that take half a second and more, and of
  /// faster ones, which are less when the gyro is smoothed.
  double gain_slow = 1, gain_slow_sigma = 0, gain_fast = 1, gain_fast_sigma = 0;
  double misfit = 0;                       ///< of corners between images, normalised coordinates; 0: not known
  std::optional<InertialMotion> inertial;  ///< against the accelerometer; empty: not known
};
/// `steps`: the recording's rotations, or those of another reading of its camera.
MotionEstimate estimateMotion(const Recording& recording, const std::vector<RotationStep>& steps,
                              double max_offset = 0.2);

/// Another reading of the camera's calibration under which pixels, depth and gyroscope fit far better, or coefficients
/// that no reading makes fit. Empty when the calibration fits or when it is not known.
std::optional<Finding> cameraFinding(const Recording& recording, const MotionEstimate& motion);

/// What accelerometer, gyroscope, depth and images say of the same motion: axes that are not as configured, mirrored
/// pictures, a wrong unit of depth. At most one finding, the cause; empty when they fit or when it is not known.
std::optional<Finding> inertialFinding(const Recording& recording, const MotionEstimate& motion);

}  // namespace vip_slam
