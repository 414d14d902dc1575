// Which keyframe each landmark on a plane is compared with: its host in the host-observer pairs of the homographies.
#pragma once

#include <vector>

#include "landmark_views.h"
#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam {

/// Per landmark the view (counted from its first) that is its host, -1: none sees it well enough or it is on no plane.
/// `plane`: per landmark, -1: none. A host must see the plane well and be of the point's own track, since its ray is
/// what the others are compared with.
/// The first such view; with `shared`, the frame that could host most of the landmarks still without host becomes
/// theirs, whichever plane they are on, and so on: few hosts, so that few pairs of frames share a factor and the system
/// is sparse. `middle`: only views from the middle of its track may host a landmark then. The host's noise is in all of
/// its pairs; with views before and after it, what it does to the motion cancels.
std::vector<int> chooseHosts(const LandmarkViews& views, const std::vector<int>& plane,
                             const std::vector<BaPlane>& planes, const std::vector<FrameGeometry>& geometry,
                             bool shared, bool middle);

}  // namespace vip_slam
