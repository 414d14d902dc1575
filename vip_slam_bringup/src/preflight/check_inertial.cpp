// SPDX-License-Identifier: BSD-3-Clause
// Axes of accelerometer and gyroscope, mirrored pictures and the unit of depth, from the motion (inertial_motion.h).
#include <cmath>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kSameRotation = 15 * kDegree;
constexpr double kExplained = 0.7;                    // of the velocity's variance, for a scale that is believed
constexpr double kSure = 4.0;                         // sigmas
constexpr double kScaleMatters = 0.03, kWrong = 0.1;  // smaller ones the back end measures better

double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::Quaterniond(a).angularDistance(Eigen::Quaterniond(b));
}

/// "-y, -z, x": where the axes x, y, z point.
std::string axesText(const Eigen::Matrix3d& P) {
  std::string out;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Index row;
    P.col(axis).cwiseAbs().maxCoeff(&row);
    out += formatted("%s%s%c", axis ? ", " : "", P(row, axis) < 0 ? "-" : "", "xyz"[row]);
  }
  return out;
}

/// The axes are not the same: what is as configured, and what is not.
Finding axesFinding(const Recording& r, const MotionEstimate& motion) {
  const Eigen::Matrix3d& P = motion.inertial->axes;
  const Eigen::Matrix3d configured = extrinsicsOfTf(r).value_or(r.sensor.T_imu_cam).R();
  const Eigen::Matrix3d found = motion.R_imu_cam.toRotationMatrix();
  const bool reversed = P.isApprox(-Eigen::Matrix3d::Identity());
  if (reversed) {
    const Eigen::DiagonalMatrix<double, 3> sideways(1, -1, -1), upright(-1, 1, -1);
    for (const auto& [turned, how] :
         {std::make_pair(sideways, "left and right"), std::make_pair(upright, "top and bottom")})
      if (angleBetween(found, configured * turned) < kSameRotation)
        return {Severity::kError, "colour image",
                formatted("is mirrored, %s changed over: it moves as the IMU says only when it is mirrored back", how),
                "switch off the driver's mirroring (flip), of colour and depth"};
    if (angleBetween(found, configured) < kSameRotation)
      return {Severity::kError, "accelerometer", "has the opposite sign: it reports gravity, not the specific force",
              "lying still and level, the axis that points up must show +9.81; change the signs in the driver"};
  }
  const std::string axes = "x, y, z of the accelerometer are " + axesText(P) + " of the gyroscope";
  if (P.determinant() < 0)
    return {Severity::kError, "IMU", axes + ": one of them is left-handed", "check the signs in the driver"};
  std::string which = "; neither of them is as T_imu_cam has it";
  if (angleBetween(found, configured) < kSameRotation) which = "; T_imu_cam is right for the gyroscope";
  if (angleBetween(P.transpose() * found, configured) < kSameRotation)
    which = "; T_imu_cam is right for the accelerometer";
  return {Severity::kError, "IMU", axes + which,
          "publish both in the same axes (those of the frame that T_imu_cam is of)"};
}

/// With as few digits as one sigma allows: units are round numbers.
std::string roundText(double value, double sigma) {
  for (int digits = 1; digits < 6; ++digits) {
    const std::string text = formatted("%.*g", digits, value);
    if (std::abs(std::stod(text) - value) < 1.5 * sigma) return text;
  }
  return formatted("%.6g", value);
}

std::optional<Finding> scaleFinding(const Recording& r, const InertialMotion& motion) {
  const double difference = motion.scale - 1;
  if (!(motion.scale_sigma > 0) || motion.explained < kExplained ||
      std::abs(difference) < std::max(kScaleMatters, kSure * motion.scale_sigma))
    return std::nullopt;
  const double scale = r.sensor.depth_scale;
  const std::string advice =
      r.sensor.depth_encoding == "32FC1"
          ? "depth must be in metres; check the driver"
          : formatted("set depth/scale: %s in the sensor file (it says %.6g)",
                      roundText(scale * motion.scale, scale * motion.scale_sigma).c_str(), scale);
  return Finding{std::abs(difference) > kWrong ? Severity::kError : Severity::kWarning, "depth scale",
                 formatted("a metre of depth is %.3f m by images and accelerometer (one sigma %.3f)", motion.scale,
                           motion.scale_sigma),
                 advice};
}

}  // namespace

std::optional<Finding> inertialFinding(const Recording& r, const MotionEstimate& motion) {
  if (!motion.inertial) return std::nullopt;
  if (motion.inertial->axes_known && !motion.inertial->axes.isIdentity()) return axesFinding(r, motion);
  // An IMU that is smoothed, or of a wrong scale, would make depth look wrong.
  const double gain = std::abs(motion.gain_fast - 1);
  const auto scale = scaleFinding(r, *motion.inertial);
  return scale && std::abs(motion.inertial->scale - 1) > 4 * gain ? scale : std::nullopt;
}

}  // namespace vip_slam
