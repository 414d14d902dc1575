// SPDX-License-Identifier: BSD-3-Clause
// Detects that a surface was moved: a cupboard shifted by a hand's breadth, a door left ajar.
#pragma once

#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// The first keyframe that saw the surface at its present place; 0: it was not moved. It was moved when from one
/// keyframe on all observations are offset along the normal against those before, by `min_shift` metres and
/// significantly more than the groups scatter, and show the same part of it. (Fronts of boxes on a shelf disagree as
/// well, but each keyframe shows other ones.) `min_views`: of each group.
KeyframeId surfaceMovedAt(const PlaneTrack& track, const CameraPoses& poses, int min_views, double min_shift);

}  // namespace vip_slam
