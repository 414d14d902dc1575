// SPDX-License-Identifier: BSD-3-Clause
// Short bags that look like a driver's output: its topics, encodings, sizes, rates, frames. A camera in a textured box,
// first still, then turning and swaying; the IMU follows the same motion. Faults can be built in one by one.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam::test_support {

/// Frames of the messages.
struct BagFrames {
  std::string color = "camera_color_optical_frame", depth = "camera_color_optical_frame";
  std::string imu = "camera_imu_optical_frame", gyro = "camera_gyro_optical_frame",
              accel = "camera_accel_optical_frame";
};

struct TfEdge {
  std::string parent, child;
  SE3 T_parent_child;
};

struct DriverBagOptions {
  /// Topics, encodings, rates, extrinsics, lens of the bag; with depth_undistorted the depth image is rendered without
  /// the lens, and its camera_info has no distortion.
  SensorConfig sensor;
  BagFrames frames;
  std::vector<TfEdge> edges;  ///< of /tf_static; empty: the extrinsics below camera_link
  double accel_rate = 250;    ///< Hz, of a stream of its own
  double still = 0.6;         ///< seconds at the start
  double moving = 2.0;        ///< seconds after it
  int width = 0, height = 0;  ///< of the images; 0: as the sensor file's camera
  // What can go wrong:
  std::map<std::string, std::string> renamed;  ///< topic -> other topic; to "": left out
  double image_rate_factor = 1;
  double depth_skew = 0;  ///< seconds that depth is stamped later than colour
  double depth_unit_factor = 1;
  int depth_divisor = 1;   ///< depth image smaller than colour by this
  bool calibrated = true;  ///< false: camera_info has empty K and P
  int empty_infos = 0;     ///< so many images at the beginning have an empty camera_info
  double accel_factor = 1;
  bool gravity = true;
  double gyro_factor = 1;
  double imu_hole_at = -1, imu_hole = 0;  ///< seconds after the start; length
  double late_jump = 0;                   ///< stamps of the second half are moved by this
  bool tf = true;
  bool second_camera = false;  ///< another camera publishes on the image topics, 12 ms after; its frames are "back_..."
  int repeat_every = 0;        ///< n: every n-th image repeats the pixels of the one before; 0: none
  std::string other_encoding;  ///< of the colour image, "" as the sensor file
};

/// Writes the bag; returns the true poses of the IMU at the image stamps.
Trajectory writeDriverBag(const std::string& path, const DriverBagOptions& options);

}  // namespace vip_slam::test_support
