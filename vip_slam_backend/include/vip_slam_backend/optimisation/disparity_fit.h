// SPDX-License-Identifier: BSD-3-Clause
// Estimates a common disparity error of a stereo or structured-light camera (a tenth of a pixel, say) from the map.
// Most of its effect on depth is an offset and a scale, which a map cannot observe. But its curvature is observable
// where planes are seen from near and from far, and since the error has one parameter, offset and scale follow from it.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam {

/// Excess of 1/reading (disparity_curve.h), 1/m, from the depth points on planes of this session's newest keyframes, in
/// addition to the correction that they have already. Empty unless it is significant and, the first time (`again` =
/// false), large enough; empty for cameras that measure no disparity. Poses are fixed, planes are free; poses have
/// absorbed part of the error, so it takes two or three rounds with an adjustment in between.
std::optional<double> fitDisparityError(const Map& map, const DepthNoise& noise, bool again);

/// Message to the user about an estimated error; empty for 0.
std::string disparityDifference(double error);

}  // namespace vip_slam
