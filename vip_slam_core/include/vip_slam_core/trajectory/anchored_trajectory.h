// The poses of all images, from odometry and keyframes.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

/// An image's pose as the front end gave it.
struct OdometryPose {
  double t = 0;  ///< image stamp, seconds
  std::uint32_t epoch = 0;
  SE3 T_odom_I;
};

/// A keyframe's pose when it was made and as the map has it in the end.
struct Anchor {
  double t = 0;
  std::uint32_t epoch = 0;
  SE3 T_odom_I, T_map_I;
  /// Maps the body as the front end had it then into the body as known now, which differ when the camera's mounting was
  /// learnt meanwhile: T_I_C now * (T_I_C then)^-1.
  SE3 T_now_then;
};

/// Carries each image's odometry over to the neighbouring keyframes of its epoch: before the first and after the last
/// keyframe it follows that one, in between the two predictions are blended by time. Blending poses (not the
/// corrections map->odom) keeps the lever arm to the origin of odom out of it. Images of an epoch without keyframes
/// have no pose in map and are left out. Both lists ascend in t.
Trajectory anchorTrajectory(const std::vector<OdometryPose>& odometry, const std::vector<Anchor>& anchors);

}  // namespace vip_slam
