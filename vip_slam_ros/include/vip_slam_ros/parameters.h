// SPDX-License-Identifier: BSD-3-Clause
// Option structs from ROS parameters: "group/name" is read below the given namespace.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ros/node_handle.h>

#include "vip_slam_core/util/options.h"

namespace vip_slam {

/// The parameters below `nh`'s namespace except `others`, as "group/name" -> text. Throws std::invalid_argument naming
/// a parameter that is a list.
std::vector<std::pair<std::string, std::string>> readParameters(const ros::NodeHandle& nh,
                                                                const std::set<std::string>& others);

/// Sets the options that have a parameter. Throws std::invalid_argument naming the parameter, its value and what was
/// expected; a parameter without an option is an error, with the nearest known name. `others`: names read by others,
/// such as dynamic_reconfigure.
template <class Options>
void loadOptionsFromParameters(Options& options, const ros::NodeHandle& nh, const std::set<std::string>& others) {
  setOptions(options, readParameters(nh, others));
}

}  // namespace vip_slam
