// SPDX-License-Identifier: BSD-3-Clause
// The calibration that the front end resolved, passed to the other nodelets.
#pragma once

#include <string>

#include <vip_slam_msgs/Calibration.h>

#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

vip_slam_msgs::Calibration toCalibrationMsg(const SensorConfig& sensor, double t, const std::string& camera_frame);

/// Puts intrinsics and extrinsics of the message into `sensor`. Throws std::invalid_argument naming the field that is
/// unusable.
void applyCalibration(const vip_slam_msgs::Calibration& msg, SensorConfig* sensor);

}  // namespace vip_slam
