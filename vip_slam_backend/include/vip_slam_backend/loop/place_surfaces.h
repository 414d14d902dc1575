// Which planes of the map a depth image shows, point by point.
#pragma once

#include <vector>

#include "vip_slam_backend/loop/place_pose.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

/// Points of `grid`, taken at T_W_C up to a few centimetres and a degree, with the plane that the view (a keyframe of
/// the map) shows in the same spot. A plane weighs the same however much of the image it fills: the errors of one
/// depth image are of one piece. `camera` goes into the result.
std::vector<PlaceSurface> matchSurfaces(const Map& map, KeyframeId view, const DepthGrid& grid, const SE3& T_W_C,
                                        const CameraModel& model, std::uint32_t camera);

}  // namespace vip_slam
