// SPDX-License-Identifier: BSD-3-Clause
// The poses of all images, from odometry and keyframes.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

/// Camera pose at an image as published by the front end.
struct ChainedPose {
  double t = 0;  ///< image stamp, seconds
  std::uint32_t epoch = 0;
  SE3 T_chain_C;              ///< see TrackedFrame
  double sigma_velocity = 0;  ///< m/s, one sigma of the velocity at the image: how fast the chain may go wrong
};

/// One sigma of a velocity in three directions, m/s, from the covariance of a state (see TrackedFrame).
double velocitySigma(const Matrix15d& covariance);

/// A keyframe's pose when it was created, and its final pose in the map.
struct Anchor {
  double t = 0;
  std::uint32_t epoch = 0;
  SE3 T_chain_C, T_map_I;
  /// Present camera-IMU extrinsics: images give the camera's motion, and these the body's.
  SE3 T_I_C;
};

/// Places each image relative to the neighbouring keyframes of its epoch by their chained poses: before the first and
/// after the last keyframe relative to that one, in between the two predictions are interpolated. The share of the
/// later one is that of the drift gathered up to the image, the integral of sigma_velocity: steady while tracking, but
/// without images an IMU errs by the square of the time. Interpolating poses (not the corrections map->odom) avoids the
/// lever arm to the origin of odom. Images of an epoch without keyframes have no pose in map and are left out. Both
/// lists ascend in t.
Trajectory anchorTrajectory(const std::vector<ChainedPose>& chain, const std::vector<Anchor>& anchors);

}  // namespace vip_slam
