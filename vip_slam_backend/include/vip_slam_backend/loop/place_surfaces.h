// SPDX-License-Identifier: BSD-3-Clause
// Associates the points of a depth image with planes of the map.
#pragma once

#include <vector>

#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

/// Points of `grid`, whose pose T_W_C is known to a few centimetres and a degree, with the plane that the view (a
/// keyframe of the map) shows at the same place. Each plane has the same total weight regardless of its size in the
/// image, since the errors of one depth image are correlated. `camera` is copied to the result.
std::vector<PlaceSurface> matchSurfaces(const Map& map, KeyframeId view, const DepthGrid& grid, const SE3& T_W_C,
                                        const CameraModel& model, std::uint32_t camera);

}  // namespace vip_slam
