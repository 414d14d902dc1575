// SPDX-License-Identifier: BSD-3-Clause
// The last of the preflight checks: the odometry itself on the recording. What none of the others looks for shows in
// what the odometry makes of it.
#pragma once

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_ros/bag_files.h"

namespace vip_slam {

/// Runs the odometry over the first `seconds` of the images, as run_bag does with its defaults: images without a pose
/// or with a degraded one, an IMU that images contradict, depth of another moment. Throws std::runtime_error as
/// BagReader does.
Findings trialRun(BagSet bags, SensorConfig sensor, double seconds);

}  // namespace vip_slam
