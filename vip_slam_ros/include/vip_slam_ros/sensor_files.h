// SPDX-License-Identifier: BSD-3-Clause
// Paths of sensor configurations.
#pragma once

#include <string>
#include <vector>

namespace vip_slam {

/// Names of the shipped sensor configurations, sorted.
std::vector<std::string> shippedSensors();
/// Path of a sensor configuration: the given file if it exists, else the shipped one of that name. Throws
/// std::invalid_argument with the list of names when there is neither.
std::string resolveSensor(const std::string& name_or_path);

}  // namespace vip_slam
