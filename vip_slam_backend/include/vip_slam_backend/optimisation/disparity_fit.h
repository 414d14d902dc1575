// What the map says about the disparities of a stereo or structured-light camera. When they are all off by the same (a
// tenth of a pixel, say), most of what it does to depth passes for an offset and a scale, which a map cannot tell. But
// what bends shows, where planes are seen from near and from far, and as the camera can make nothing else of it, offset
// and scale follow from the bend.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// 1/m: what 1/reading has too much (disparity_curve.h), by the depth points on planes of this session's newest
/// keyframes over what they have been added already. Nothing unless it is beyond doubt and, the first time
/// (`again` = false), large enough to be no accident; nothing for cameras that measure no disparity. Poses are held,
/// planes are free; poses have adapted to some of it, so it takes two or three rounds with an adjustment in between.
std::optional<double> fitDisparityError(const Map& map, const DepthNoise& noise, bool again);

/// What to tell the user of an error that was found; empty for 0.
std::string disparityDifference(double error);

}  // namespace vip_slam
