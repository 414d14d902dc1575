// Whether a surface has been moved: a cupboard put elsewhere by a hand's breadth, a door left ajar.
#pragma once

#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// The first keyframe that saw the surface where it is now; 0: it was not moved. Moved it was when from one keyframe on
/// all observations lie beside those before, along the normal, by far more than each group scatters, and show the same
/// part of it. (Fronts of boxes on a shelf disagree as well, but each keyframe shows others.)
KeyframeId surfaceMovedAt(const PlaneTrack& track, const CameraPoses& poses);

}  // namespace vip_slam
