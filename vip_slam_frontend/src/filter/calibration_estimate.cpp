// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/calibration_estimate.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_frontend/filter/calibration_evidence.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {
namespace {

/// What a difference has to exceed to be told: significant, and large enough against what was believed to matter.
double limit(double given, double found) {
  return std::max(kGateSigmas * found, frontend::CalibrationEvidence::kHeld * given);
}

template <typename Array>
Array limit(const Array& given, const Array& found) {
  return given.binaryExpr(found, [](double g, double f) { return limit(g, f); });
}

bool exceeds(const Eigen::Vector3d& difference, const Eigen::Vector3d& given, const Eigen::Vector3d& found) {
  return found.minCoeff() > 0 && (difference.array().abs() > limit<Eigen::Array3d>(given, found)).any();
}

/// As in a sensor file, precise enough to pass there for a rotation.
std::string rowsOf(const SE3& T) {
  const Eigen::Array44d M = (1e5 * T.matrix().array()).round() / 1e5 + 0.0;  // no minus before a zero
  std::string rows;
  for (int r = 0; r < 3; ++r) rows += formatted("[%.5f, %.5f, %.5f, %.5f], ", M(r, 0), M(r, 1), M(r, 2), M(r, 3));
  return rows + "[0, 0, 0, 1]";
}

}  // namespace

std::vector<std::string> calibrationDifferences(const CalibrationEstimate& given, const CalibrationEstimate& found) {
  std::vector<std::string> all;
  const Vector6d change = found.T_I_C.boxminus(given.T_I_C);
  const Eigen::Vector3d turn = change.head<3>(), shift = change.tail<3>();
  if (exceeds(turn, given.sigma_rotation, found.sigma_rotation)) {
    all.push_back(
        formatted("the camera is turned by %.2f degrees against T_imu_cam of the sensor's configuration, which is "
                  "corrected for; T_imu_cam should have the rows ",
                  turn.norm() / kDegree) +
        rowsOf(found.T_I_C));
  }
  if (exceeds(shift, given.sigma_translation, found.sigma_translation)) {
    all.push_back(
        formatted("the camera sits %.1f mm beside where T_imu_cam of the sensor's configuration has it, which is "
                  "corrected for; T_imu_cam should have the rows ",
                  1e3 * shift.norm()) +
        rowsOf(found.T_I_C));
  }
  const double delay = found.time_offset - given.time_offset;
  const double least_delay = limit(given.sigma_time_offset, found.sigma_time_offset);
  if (found.sigma_time_offset > 0 && std::abs(delay) > least_delay && found.delay_drifts) {
    all.push_back(formatted(
        "the delay of the images drifts and is followed: from the %.1f ms of time_offset to %.1f ms by now; are "
        "images and IMU stamped by two clocks? Let the driver stamp both by one; no time_offset holds for long",
        1e3 * given.time_offset, 1e3 * found.time_offset));
  } else if (found.sigma_time_offset > 0 && std::abs(delay) > least_delay) {
    all.push_back(
        formatted("images lag by %.1f ms, not by the %.1f ms of time_offset in the sensor's configuration, which is "
                  "corrected for; time_offset should be %.4f",
                  1e3 * found.time_offset, 1e3 * given.time_offset, found.time_offset));
  }
  if (found.depth_contradicts) {
    all.push_back(
        "depth and images disagree by more than depth readings that are too long or too short; are both of the same "
        "moment, depth registered to the colour camera, its focal length right?");
  }
  const double depth = found.depth_offset - given.depth_offset;
  if (found.sigma_depth_offset > 0 && std::abs(depth) > limit(given.sigma_depth_offset, found.sigma_depth_offset)) {
    all.push_back(
        formatted("depth reads %.1f mm too %s at all distances, which is corrected for; depth/offset in the sensor's "
                  "configuration should be %.4f",
                  1e3 * std::abs(depth), depth < 0 ? "long" : "short",
                  1e-4 * std::round(1e4 * found.depth_offset) + 0.0));  // no minus before a zero
  }
  const double scale = found.depth_scale - given.depth_scale;
  if (found.sigma_depth_scale > 0 && std::abs(scale) > limit(given.sigma_depth_scale, found.sigma_depth_scale)) {
    const std::string remedy =
        found.depth_unit > 0 && !found.gyro_contradicts  // of an IMU whose rates are wrong neither is the scale right
            ? formatted(" Else depth/scale in the sensor's configuration should be %.6g", found.depth_unit)
            : "";
    all.push_back(formatted("depth reads %.1f %% too %s by the accelerometer (one sigma %.1f %%), which is corrected "
                            "for: is the IMU smoothed (check_bag tells)?",
                            100 * std::abs(scale), scale < 0 ? "long" : "short", 100 * found.sigma_depth_scale) +
                  remedy);
  }
  const double late = found.depth_delay - given.depth_delay;
  if (found.sigma_depth_delay > 0 && std::abs(late) > limit(given.sigma_depth_delay, found.sigma_depth_delay)) {
    all.push_back(formatted(
        "depth shows %s moment than its stamps say, by %.0f ms (one sigma %.0f ms), which is corrected for: is "
        "a temporal filter on in the driver, are the two cameras not taken together? depth/delay in the "
        "sensor's configuration should be %.3f",
        late > 0 ? "an earlier" : "a later", 1e3 * std::abs(late), 1e3 * found.sigma_depth_delay, found.depth_delay));
  }
  const double read = found.readout - given.readout;
  if (found.sigma_readout > 0 && std::abs(read) > limit(given.sigma_readout, found.sigma_readout)) {
    const double seconds = 1e-4 * std::round(1e4 * found.readout) + 0.0;  // no minus before a zero
    all.push_back(
        formatted("the rows of a colour image are read within %.1f ms (one sigma %.1f ms), not %.1f ms, which is "
                  "corrected for; ",
                  1e3 * seconds, 1e3 * found.sigma_readout, 1e3 * given.readout) +
        (seconds < 0 ? std::string("the last row comes first: is the image turned round?")
                     : formatted("color/rolling_shutter in the sensor's configuration should be %.4f", seconds)));
  }
  const Eigen::Array2d beside = (found.depth_shift - given.depth_shift).cwiseAbs();
  const Eigen::Array2d& beside_sigma = found.sigma_depth_shift.array();
  if ((beside_sigma > 0 && beside > limit<Eigen::Array2d>(given.sigma_depth_shift, beside_sigma)).any()) {
    all.push_back(formatted(
        "the depth image lies beside the colour image by [%.2f, %.2f] pixels, not by depth/shift of the sensor's "
        "configuration, which is corrected for: is it registered to colour, are its holes filled from one side (switch "
        "that off)? check_bag tells",
        found.depth_shift_px.x(), found.depth_shift_px.y()));
  }
  const Eigen::Array4d bearing = (found.bearing.value - given.bearing.value).cwiseAbs();
  const Eigen::Array4d& bearing_sigma = found.sigma_bearing.array();
  if ((bearing_sigma > 0 && bearing > limit<Eigen::Array4d>(given.sigma_bearing, bearing_sigma)).any()) {
    const Eigen::Vector4d& k = found.intrinsics;
    all.push_back(
        formatted("focal length or principal point are off, which is corrected for; fx, fy, cx, cy in the sensor's "
                  "configuration or camera_info should be %.1f, %.1f, %.1f, %.1f",
                  k(0), k(1), k(2), k(3)));
  }
  const Eigen::Array33d gyro = (found.gyro_correction - given.gyro_correction).cwiseAbs();
  const Eigen::Array33d& sigma = found.sigma_gyro_correction.array();
  const Eigen::Array33d off =
      (sigma > 0 && gyro > limit<Eigen::Array33d>(given.sigma_gyro_correction, sigma)).select(gyro, 0.0);
  if (off.maxCoeff() > 0 && found.gyro_contradicts) {
    all.push_back(formatted(
        "the gyro's rates differ from the turns of the images by up to %.1f %%, which is corrected for, more than "
        "imu/gyro_correction_sigma allows the scale of an axis: is the IMU smoothed or shaken, its range too small, "
        "the focal length wrong (check_bag tells)? A sensor whose gyro is less exact should say so there",
        100 * off.maxCoeff()));
  } else if (off.maxCoeff() > 0) {
    const Eigen::Matrix3d& C = found.gyro_correction;
    all.push_back(formatted(
        "scale or alignment of the gyro's axes is off by up to %.1f %%, which is corrected for: is the IMU smoothed or "
        "shaken (check_bag tells)? Else imu/gyro_correction in the sensor's configuration should have the rows [%.4f, "
        "%.4f, %.4f], [%.4f, %.4f, %.4f], [%.4f, %.4f, %.4f]",
        100 * off.maxCoeff(), C(0, 0), C(0, 1), C(0, 2), C(1, 0), C(1, 1), C(1, 2), C(2, 0), C(2, 1), C(2, 2)));
  }
  return all;
}

}  // namespace vip_slam
