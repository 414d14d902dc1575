// SPDX-License-Identifier: BSD-3-Clause
// One sensor = one YAML file: topics, encodings, intrinsics, extrinsics, IMU and depth noise, delay.
// Keys are documented in vip_slam_bringup/config/sensors/README.md; every shipped and every simulated file has them
// all.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

struct SensorTopics {
  std::string color, color_info, depth, depth_info;
  std::string imu;          ///< gyroscope and accelerometer in one message; empty when they come apart, or not at all
  std::string gyro, accel;  ///< streams of their own, both or one of them; empty when there is `imu`, or none

  /// Which inertial streams there are. Neither: RGB-D alone, no inertial sample ever comes.
  bool hasGyro() const { return !imu.empty() || !gyro.empty(); }
  bool hasAccel() const { return !imu.empty() || !accel.empty(); }
  bool hasInertial() const { return hasGyro() || hasAccel(); }
  /// The stream whose frame is the IMU's: `imu`, else `gyro`, else `accel`; empty when there is none.
  const std::string& inertial() const { return !imu.empty() ? imu : !gyro.empty() ? gyro : accel; }
};

struct SensorConfig {
  std::string name;
  SensorTopics topics;
  std::string color_encoding = "rgb8";   ///< rgb8, bgr8, mono8, mono16, rgba8, bgra8, yuv422 or "compressed" (JPEG/PNG)
  std::string depth_encoding = "16UC1";  ///< 16UC1, 32FC1 or "compressed" (16-bit PNG, also compressedDepth)
  double depth_scale = 0.001;            ///< metres per unit of 16UC1
  double depth_offset = 0;               ///< metres to be added to every reading
  /// Seconds by which a depth image shows an earlier moment than its stamp says, beside a rolling shutter.
  double depth_delay = 0;
  Eigen::Vector2d depth_shift = Eigen::Vector2d::Zero();  ///< px, see depth_shift.h
  DepthCurve depth_curve;                                 ///< distance-dependent correction, applied after that
  bool depth_registered = true;                           ///< depth pixels belong to the colour camera
  /// Registered depth lies in the colour camera's image without distortion, though the colour image has some.
  bool depth_undistorted = false;
  double color_rate = 30, depth_rate = 30, imu_rate = 200;  ///< Hz, nominal; for checks and messages

  double rolling_shutter = 0;  ///< colour: seconds from first to last row, stamp at the middle row; 0: global shutter
  double depth_rolling_shutter = 0;  ///< the same for the depth image; 0: global shutter

  bool intrinsics_from_camera_info = true;  ///< else `camera` below is used
  CameraIntrinsics camera;                  ///< colour camera; may be empty when from camera_info
  CameraIntrinsics depth_camera;            ///< only when not registered
  SE3 T_color_depth;                        ///< only when not registered

  bool hasGyro() const { return topics.hasGyro(); }
  bool hasAccel() const { return topics.hasAccel(); }

  SE3 T_imu_cam;   ///< colour optical frame into IMU frame; without any IMU the "IMU" frame is the body's, see README
  SE3 T_base_imu;  ///< IMU into base_link; identity unless the robot says otherwise
  ImuNoise imu_noise;
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< see gyro_correction.h
  DepthNoise depth_noise;
  /// Mask of the colour image as published: 255 where it is used, 0 where the robot itself is in view; empty: all is
  /// used. `mask_file`: the file that it was read from.
  cv::Mat mask;
  std::string mask_file;
  double time_offset = 0;  ///< seconds; t_imu = t_image + time_offset
  double gravity = 9.81;   ///< m/s^2
};

/// Empty when the mask has the size of the colour image; else a message "mask: ...".
std::string maskProblem(const SensorConfig& config, int width, int height);

/// Throws std::runtime_error "file: key: what, expected what" on a missing file, unknown or missing key, bad value.
SensorConfig loadSensorConfig(const std::string& path);
/// `notes` receives "file: key: what" for what was not taken as it stands there: a rounded rotation is made exact.
SensorConfig loadSensorConfig(const std::string& path, std::vector<std::string>* notes);
void saveSensorConfig(const std::string& path, const SensorConfig& config);

}  // namespace vip_slam
