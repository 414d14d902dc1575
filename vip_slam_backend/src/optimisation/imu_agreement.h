// SPDX-License-Identifier: BSD-3-Clause
// Checks the IMU factor between two keyframes against the odometry, which uses images as well.
#pragma once

#include "vip_slam_backend/map/map_types.h"

namespace vip_slam {

/// Factor on the noise of the IMU factor into `keyframe`, 1 or more. Above 1 when the odometry's velocity and pose
/// contradict the factor by far more than their uncertainties, as after a shock that the IMU missed or a saturated
/// gyro: then images have corrected the odometry, while the IMU factor would distort the map. `G`: (0, 0, g).
double imuNoiseFactor(const MapKeyframe& previous, const MapKeyframe& keyframe, const Eigen::Vector3d& G);

}  // namespace vip_slam
