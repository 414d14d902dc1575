// SPDX-License-Identifier: BSD-3-Clause
// The parameters of a plane that the back end does not optimise, from the samples of its observations.
#pragma once

#include "placed_keyframes.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam::planes {

/// Also finds whether the samples determine the plane's direction; until they do, it keeps that of detection.
void fitToObservations(PlaneTrack* track, const PlacedKeyframes& keyframes);

}  // namespace vip_slam::planes
