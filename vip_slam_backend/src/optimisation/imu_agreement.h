// Whether the IMU between two keyframes says what the odometry does, which has images as well.
#pragma once

#include "vip_slam_backend/map/map_types.h"

namespace vip_slam {

/// Factor on the noise of the IMU factor into `keyframe`, 1 or more. Where the odometry's velocity and pose part from
/// the factor by far more than both may be off by, as after a blow that the IMU does not see whole or a range it ends
/// at, the odometry has been told otherwise by images; the factor alone would bend the map by what it got wrong.
/// `G`: (0, 0, g).
double imuNoiseFactor(const MapKeyframe& previous, const MapKeyframe& keyframe, const Eigen::Vector3d& G);

}  // namespace vip_slam
