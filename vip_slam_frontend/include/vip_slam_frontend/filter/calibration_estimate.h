// SPDX-License-Identifier: BSD-3-Clause
// Camera-IMU extrinsics, time offset, and the corrections of depth, intrinsics and gyro, as estimated online by the
// filter.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// Extrinsics and calibration with their sigmas; a sigma is zero for what is not estimated.
struct CalibrationEstimate {
  SE3 T_I_C;
  double time_offset = 0;                                       ///< s: t_imu = t_image + time_offset
  Eigen::Vector3d sigma_rotation = Eigen::Vector3d::Zero();     ///< rad, right perturbation
  Eigen::Vector3d sigma_translation = Eigen::Vector3d::Zero();  ///< m, in the IMU frame
  double sigma_time_offset = 0;                                 ///< s
  bool delay_drifts = false;                                    ///< faster than its random walk says; it is followed
  double depth_offset = 0;        ///< m, to be added to every reading of the depth camera, as in a sensor file
  double sigma_depth_offset = 0;  ///< m
  double depth_scale = 1;         ///< factor of every reading, before the offset, that is adopted
  double sigma_depth_scale = 0;   ///< of the present estimate
  double depth_delay = 0;         ///< s by which depth shows an earlier moment than its stamp says, that is adopted
  double sigma_depth_delay = 0;   ///< of the present estimate
  double readout = 0;             ///< s from the first to the last row of a colour image, that is adopted
  double sigma_readout = 0;       ///< of the present estimate
  double depth_unit = 0;  ///< m, the unit of readings with this factor, as in a sensor file; 0: they are in metres
  /// Shift of the depth image to the right and down against the colour image, in bearings, and one sigma.
  Eigen::Vector2d depth_shift = Eigen::Vector2d::Zero(), sigma_depth_shift = Eigen::Vector2d::Zero();
  Eigen::Vector2d depth_shift_px = Eigen::Vector2d::Zero();  ///< the same in px, as in a sensor file
  BearingCorrection bearing = {};                            ///< correction of the intrinsics in use
  Eigen::Vector4d sigma_bearing = Eigen::Vector4d::Zero();
  Eigen::Vector4d intrinsics = Eigen::Vector4d::Zero();       ///< fx, fy, cx, cy in px that make `bearing` zero
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< see gyro_correction.h
  Eigen::Matrix3d sigma_gyro_correction = Eigen::Matrix3d::Zero();
  bool gyro_contradicts = false;  ///< a significant entry is beyond what is believed of ImuNoise::gyro_correction_sigma
  bool depth_contradicts = false;  ///< depth and images disagree by more than any offset; none is used
};

/// Corrections of the sensor's configuration as sentences: differences that are both significant and large enough to
/// matter against the sigmas of `given`, by which it was believed. Empty when it is right.
std::vector<std::string> calibrationDifferences(const CalibrationEstimate& given, const CalibrationEstimate& found);

}  // namespace vip_slam
