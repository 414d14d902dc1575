// Evidence against a plane: a keyframe's depth lies behind its covered cells.
#pragma once

#include <memory>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// Takes a hit from every cell that the keyframe looks through: all four grid nodes around its image measure depth more
/// than `margin` metres (plus noise) behind the plane, which is seen from its own side and not at a grazing angle.
/// Returns the number of such cells.
int clearSeenThrough(const DepthGrid& grid, const CameraModel& camera, const DepthNoise& noise, const SE3& T_map_C,
                     double margin, PlaneTrack* track);

/// Whether the covered area's bounds may be in front of the camera within `range` metres.
bool mayBeInView(const PlaneTrack& track, const SE3& T_map_C, double range);

}  // namespace vip_slam
