#include "vip_slam_bringup/sensor_files.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include <ros/package.h>

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

fs::path folder() {
  const std::string package = ros::package::getPath("vip_slam_bringup");
  if (package.empty())
    throw std::runtime_error("package vip_slam_bringup is not on ROS_PACKAGE_PATH; source the workspace's setup.bash");
  return fs::path(package) / "config" / "sensors";
}

}  // namespace

std::vector<std::string> shippedSensors() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder()))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string findSensorFile(const std::string& name_or_path) {
  if (fs::is_regular_file(name_or_path)) return name_or_path;
  const bool is_path = name_or_path.find('/') != std::string::npos || fs::path(name_or_path).extension() == ".yaml";
  std::string known;
  for (const std::string& name : shippedSensors()) {
    if (name == name_or_path) return (folder() / (name + ".yaml")).string();
    known += (known.empty() ? "" : ", ") + name;
  }
  if (is_path) throw std::runtime_error(name_or_path + ": no such sensor file");
  throw std::runtime_error("unknown sensor '" + name_or_path + "'; shipped are " + known +
                           "; or give the path of a YAML file");
}

}  // namespace vip_slam
