// What a depth camera reads too long or too short, and what the intrinsics get wrong, when it becomes known only after
// readings and bearings were handed on: all that holds them takes over the better correction. A reading moves its point
// along the point's ray; a bearing turns the ray. Where the depth image lies beside the colour image, points on planes
// move beside with their readings, while pixels of features and of the grid stay and have other readings.
#pragma once

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// The keyframe with `correction` added to the camera's readings and bearings instead of what they have now; the same
/// one when that is what it has. Sigmas and pixels stay, and so does the grid's layout, which knows pixels only.
KeyframePtr withCameraCorrection(const KeyframePtr& keyframe, const CameraCorrection& correction);

/// The same for depth points on a plane; G is summed anew from the points.
void setCameraCorrection(const CameraCorrection& correction, PlaneObservation* observation);

}  // namespace vip_slam
