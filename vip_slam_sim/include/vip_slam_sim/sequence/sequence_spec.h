// SPDX-License-Identifier: BSD-3-Clause
// Everything that defines a sequence. One declaration per key gives default, range and meaning; the YAML of named
// sequences and a user's own file use the same keys.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/util/options.h"

namespace vip_slam {

struct MotionOptions {
  std::string type = "path";
  std::string waypoints;  ///< "x,y[,z]; ...; turn DEG; pause SECONDS"
  std::string style = "handheld";
  std::string vibration = "none";
  std::string file;
  double duration = 0, hold = 2.6, start_at = 0;
  double speed = 0.8, height = 1.5, max_rate = 0.8;
  double yaw_swing = 12, pitch = -6, turn_rate = 45;
  double x = 0, y = 0, z = 0, yaw = 0, file_roll = 0;
  double extent_x = 2.0, extent_y = 1.3, extent_z = 0.35;
  bool check_collisions = true;
  double clearance = 0.22;
  void visit(OptionVisitor& v);
};

struct CameraOptions {
  int width = 640, height = 480;
  double fx = 480, fy = 480, cx = 319.5, cy = 239.5;
  std::string model = "none";
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0;
  double rate = 20;
  double model_error = 0;
  void visit(OptionVisitor& v);
  CameraIntrinsics intrinsics() const;  ///< as stated in the sensor file
};

struct DepthOptions {
  std::string model = "proportional";
  double a = 0, b = 0.0017, c = 0, min_range = 0.2, max_range = 10;
  double dropout = 0, edge_hole = 0, grazing_limit = 0, dark_limit = 0, bias_amplitude = 0;
  double white = 1, scale = 1, offset = 0;
  double surface_error = 0, warp = 0, fixed_warp = 0, shared_px = 64, shared_time = 0.5;
  double disparity_step = 0, disparity_baseline = 0.05;
  double bias_floor = 0.005;
  int fattening = 0, coarse = 1;
  double multipath = 0;
  bool registered = true;
  double baseline = 0.015;
  double lag = 0;
  /// Whether depth comes from a separate sensor with a global shutter; otherwise it is rendered with the colour image.
  bool separate() const { return !registered || lag != 0; }
  void visit(OptionVisitor& v);
};

struct ImuOptions {
  double rate = 200;
  double gyro_noise_density = 1.7e-4, gyro_random_walk = 2e-5;
  double accel_noise_density = 2e-3, accel_random_walk = 3e-3;
  double gyro_bias = 0.01, accel_bias = 0.06;
  double scale_error = 0, misalignment = 0;
  double stated_noise = 1;
  double gyro_drift = 0, accel_drift = 0, warm_up = 60, g_sensitivity = 0;
  double time_offset = 0;
  bool present = true;
  void visit(OptionVisitor& v);
};

struct EffectOptions {
  bool auto_exposure = false;
  double exposure = 1.0, exposure_drift = 0.06, vignetting = 0.18;
  double exposure_jump = 1.0, exposure_jump_interval = 2.0;
  double read_noise = 1.0, shot_noise = 0.9;
  double exposure_time = 0.005;
  bool motion_blur = false;
  double rolling_shutter = 0;
  double gloss = 0;
  int jpeg = 0;
  void visit(OptionVisitor& v);
};

/// People who walk in front of the camera (PassersBy).
struct PasserOptions {
  int count = 0;
  std::string way = "to_and_fro";
  double width = 0.5, height = 1.75;
  double distance = 1.8, speed = 1.0;
  double start = 4, interval = 8;
  void visit(OptionVisitor& v);
};

struct SequenceSpec {
  std::string name;
  std::string scene = "room";
  int seed = 1;
  double start_time = 1600000000;
  MotionOptions motion;
  CameraOptions camera;
  DepthOptions depth;
  ImuOptions imu;
  EffectOptions effects;
  PasserOptions passers;
  void visit(OptionVisitor& v);

  /// Fixed extrinsics of the rig, about a degree and 1 to 2 cm off in every axis; without IMU the body is the camera.
  SE3 T_imu_cam() const;
  CameraIntrinsics trueCamera() const;  ///< what the colour camera is, `camera.model_error` away from what is stated
  /// Whether depth is rendered apart from colour.
  bool depthApart() const { return depth.separate() || camera.model_error > 0; }
  SensorConfig sensorConfig() const;
};

/// A named sequence of `library` (the shipped config/sequences.yaml) or, when `name_or_file` ends in .yaml, a file of
/// one sequence whose optional key `base` names the sequence it changes. Throws std::runtime_error that names the file,
/// the key and what was expected.
SequenceSpec loadSequence(const std::string& name_or_file, const std::string& library);
/// Names in the library, in order.
std::vector<std::string> sequenceNames(const std::string& library);

}  // namespace vip_slam
