// SPDX-License-Identifier: BSD-3-Clause
// The map's invariants. Tests run it after every operation; tools may run it on a loaded map.
#pragma once

#include <string>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// Empty when the map is consistent, else the first violation in words: two-way links between keyframes and landmarks,
/// ascending observations, a chain of keyframes of one odometry linked both ways and ascending in time, IMU factors
/// that fit their samples, stamps and biases, planes that exist, plane observations that are sums of squares, finite
/// numbers.
std::string checkMap(const Map& map);

}  // namespace vip_slam
