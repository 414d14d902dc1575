// How the depth noise of this recording divides into a white part and one that the points of a surface share, from the
// shape of planes in single keyframes. Neither needs a pose, so that no adjustment can hide what it shows.
//
// White: scatter of the points about the smooth surface through them. Shared: depth that errs over whole patches bends
// planes. The part of a fitted quadric that is no plane is that bend; white noise of N points makes one of a variance of
// 3/N only. What moves or turns a surface as a whole cannot be seen in one image, and is as large as what bends it on
// all cameras that were measured.
#pragma once

#include <optional>
#include <vector>

#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Of one surface, relative to the noise model. Empty with too few points for a quadric, or without a shared part.
std::optional<DepthNoiseParts> surfaceShape(const PlaneObservation& observation);

/// Medians over the surfaces, against a prior of 1 that counts as a few of them.
DepthNoiseParts depthNoiseParts(const std::vector<DepthNoiseParts>& surfaces);
/// The same over the newest observations; `newest_first`: no null pointers.
DepthNoiseParts depthNoiseParts(const std::vector<const PlaneObservation*>& newest_first);

}  // namespace vip_slam
