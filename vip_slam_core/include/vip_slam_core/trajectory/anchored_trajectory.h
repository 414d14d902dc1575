// The poses of all images, from odometry and keyframes.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

/// Where the camera was at an image, as the front end gave it.
struct ChainedPose {
  double t = 0;  ///< image stamp, seconds
  std::uint32_t epoch = 0;
  SE3 T_chain_C;  ///< see TrackedFrame
};

/// A keyframe's pose when it was made and as the map has it in the end.
struct Anchor {
  double t = 0;
  std::uint32_t epoch = 0;
  SE3 T_chain_C, T_map_I;
  /// The camera's mounting as it is known now. What the images tell is the camera's motion; the body's follows.
  SE3 T_I_C;
};

/// Carries each image's chained pose over to the neighbouring keyframes of its epoch: before the first and after the
/// last keyframe it follows that one, in between the two predictions are blended by time. Blending poses (not the
/// corrections map->odom) keeps the lever arm to the origin of odom out of it. Images of an epoch without keyframes
/// have no pose in map and are left out. Both lists ascend in t.
Trajectory anchorTrajectory(const std::vector<ChainedPose>& chain, const std::vector<Anchor>& anchors);

}  // namespace vip_slam
