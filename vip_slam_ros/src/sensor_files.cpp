// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/sensor_files.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include <ros/package.h>

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

fs::path sensorFolder() { return fs::path(ros::package::getPath("vip_slam_bringup")) / "config" / "sensors"; }

}  // namespace

std::vector<std::string> shippedSensors() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(sensorFolder(), error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string resolveSensor(const std::string& name_or_path) {
  std::error_code error;
  if (fs::is_regular_file(name_or_path, error)) return name_or_path;
  const fs::path shipped = sensorFolder() / (name_or_path + ".yaml");
  if (!name_or_path.empty() && fs::is_regular_file(shipped, error)) return shipped.string();
  std::string names;
  for (const auto& name : shippedSensors()) names += (names.empty() ? "" : ", ") + name;
  throw std::invalid_argument("sensor '" + name_or_path + "': neither a file nor a shipped sensor; shipped are: " +
                              (names.empty() ? "none found" : names));
}

}  // namespace vip_slam
