// What a depth camera reads too long or too short, when it becomes known only after its readings were handed on: all
// that holds readings takes over the better correction. A reading moves its point along the point's ray.
#pragma once

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// The keyframe with `correction` added to the camera's readings instead of what they have now; the same one when
/// that is what it has. Sigmas stay, and so does all that is no depth.
KeyframePtr withDepthCorrection(const KeyframePtr& keyframe, const DepthCorrection& correction);

/// The same for depth points on a plane; G is summed anew from the points.
void setDepthCorrection(const DepthCorrection& correction, PlaneObservation* observation);

}  // namespace vip_slam
