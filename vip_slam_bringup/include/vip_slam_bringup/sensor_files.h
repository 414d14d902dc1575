// Sensor configurations by name: the files of vip_slam_bringup/config/sensors.
#pragma once

#include <string>
#include <vector>

namespace vip_slam {

/// `name_or_path`: a YAML file, or the name of a shipped sensor ("d435i"). Throws std::runtime_error that lists the
/// shipped names when it is neither.
std::string findSensorFile(const std::string& name_or_path);
/// Names of the shipped sensors, sorted.
std::vector<std::string> shippedSensors();

}  // namespace vip_slam
