// SPDX-License-Identifier: BSD-3-Clause
// Chooses the host keyframe of each landmark on a plane, for the host-observer pairs of the homographies.
#pragma once

#include <vector>

#include "landmark_views.h"
#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam {

/// Per landmark the view (counted from its first) that is its host; -1: no view is suitable or it is on no plane.
/// `plane`: per landmark, -1: none. A host must see the plane well and belong to the point's own track, since the other
/// views are compared with its ray. Without `shared` the first such view. With `shared` the frame that can host most of
/// the landmarks still without host becomes their host, whichever plane they are on, and so on: few hosts, so that few
/// pairs of frames share a factor and the system is sparse. `middle`: then only views from the middle of its track may
/// host a landmark. The host's noise is in all of its pairs; with views before and after it the effect on the motion
/// cancels.
std::vector<int> chooseHosts(const LandmarkViews& views, const std::vector<int>& plane,
                             const std::vector<BaPlane>& planes, const std::vector<FrameGeometry>& geometry,
                             bool shared, bool middle);

}  // namespace vip_slam
