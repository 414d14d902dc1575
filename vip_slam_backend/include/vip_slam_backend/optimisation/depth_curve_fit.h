// What the map says about the depth camera. A wall seen from near and from far has one place in the map: where its
// depth points lie before it at some distances and behind it at others, the camera reads too short and too long there.
// A time-of-flight camera's wiggle of some millimetres shows to a few tenths of one.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// What the depth points on planes of this session's newest keyframes have to be added, over what they have already;
/// nothing unless it is beyond doubt. Poses are held, planes are free; a value in which offset and scale have no part:
/// those a map cannot tell from its own size, and the front end knows the offset better.
std::optional<DepthCurve> fitDepthCurve(const Map& map, const DepthNoise& noise);

/// What to tell the user of a curve that was found, when it is large enough to matter (2 mm); empty else.
std::string depthCurveDifference(const DepthCurve& found);

}  // namespace vip_slam
