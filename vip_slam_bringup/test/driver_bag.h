// Short bags that look like a driver's output: its topics, encodings, sizes, rates, frames. A camera in a textured box,
// first still, then turning and swaying; the IMU follows the same motion. Faults can be built in one by one.
#pragma once

#include <map>
#include <string>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam::test_support {

struct DriverBagOptions {
  SensorConfig sensor;        ///< topics, encodings, rates and extrinsics of the bag
  double still = 0.6;         ///< seconds at the start
  double moving = 2.0;        ///< seconds after it
  int width = 0, height = 0;  ///< of the images; 0: as the sensor file's camera
  // What can go wrong:
  std::map<std::string, std::string> renamed;  ///< topic -> other topic; to "": left out
  double image_rate_factor = 1;
  double depth_skew = 0;  ///< seconds that depth is stamped later than colour
  double depth_unit_factor = 1;
  int depth_divisor = 1;   ///< depth image smaller than colour by this
  bool calibrated = true;  ///< false: camera_info has an empty K
  double accel_factor = 1;
  bool gravity = true;
  double gyro_factor = 1;
  double imu_hole_at = -1, imu_hole = 0;  ///< seconds after the start; length
  double late_jump = 0;                   ///< stamps of the second half are moved by this
  bool tf = true;
  int repeat_every = 0;        ///< n: every n-th image repeats the pixels of the one before; 0: none
  std::string other_encoding;  ///< of the colour image, "" as the sensor file
};

/// Writes the bag; returns the true poses of the IMU at the image stamps.
Trajectory writeDriverBag(const std::string& path, const DriverBagOptions& options);

}  // namespace vip_slam::test_support
