// SPDX-License-Identifier: BSD-3-Clause
// What the cameras' drivers publish and which arguments their launch files have: the tables in test/drivers, one file a
// driver, written from the drivers' sources and not from our sensor files.
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "driver_bag.h"

namespace vip_slam::test_support {

struct DriverLaunch {
  std::string package, file;  ///< "launch/x.launch"
  /// Branch of the driver -> argument -> default.
  std::map<std::string, std::map<std::string, std::string>> branches;
};

struct DriverCamera {
  std::string name;    ///< of our launch file
  std::string sensor;  ///< of our sensor file
  DriverLaunch launch;
  std::string ns;                            ///< namespace that the driver's launch file has to be included in
  std::map<std::string, std::string> needs;  ///< arguments that the rest depends on
  SensorConfig published;                    ///< topics, encodings, rates, lens, extrinsics, delay; the rest is default
  std::vector<std::string> types;            ///< ROS types of colour, depth and IMU messages
  BagFrames frames;
  std::vector<TfEdge> edges;            ///< of the driver's tf
  std::vector<std::string> all_frames;  ///< of these, and those of messages
  double accel_rate = 250;

  /// A bag as the driver writes it.
  DriverBagOptions bag() const;
};

/// For googletest's messages.
inline void PrintTo(const DriverCamera& camera, std::ostream* out) { *out << camera.name; }

/// All cameras of all tables. Throws std::runtime_error naming file and camera.
std::vector<DriverCamera> driverCameras();

/// The include of a driver's launch file in one of ours.
struct LaunchInclude {
  std::string sensor;                         ///< default of our argument `sensor`
  std::string ns;                             ///< of the group around it
  std::map<std::string, std::string> passed;  ///< $(arg NAME) is replaced by our default
};

/// Throws std::runtime_error when `path` does not include that file.
LaunchInclude readLaunch(const std::string& path, const DriverLaunch& driver);

}  // namespace vip_slam::test_support
