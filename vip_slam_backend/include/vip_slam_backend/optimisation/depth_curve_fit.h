// SPDX-License-Identifier: BSD-3-Clause
// Estimates the depth camera's distance-dependent error from the map. A wall seen from near and from far has one place
// in the map: where its depth points lie in front of it at some distances and behind it at others, the camera reads too
// short and too long there. A time-of-flight camera's periodic error of some millimetres is found to a few tenths of
// one.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Further correction of the readings, from the depth points on planes of this session's newest keyframes; empty unless
/// it is significant.
/// Poses are fixed, planes are free. Offset and scale are excluded from the curve: a map cannot separate them from its
/// own scale, and the front end estimates the offset better.
std::optional<DepthCurve> fitDepthCurve(const Map& map, const DepthNoise& noise);

/// Message to the user about an estimated curve when it is large enough to matter (2 mm); empty otherwise.
std::string depthCurveDifference(const DepthCurve& found);

}  // namespace vip_slam
