// SPDX-License-Identifier: BSD-3-Clause
// Evidence against a plane: a keyframe's depth lies behind its covered cells, or belongs to another plane there.
#pragma once

#include <memory>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_planes/association/surface_labels.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

/// Cosine of 75 degrees between normal and ray: flatter, missing or farther depth says nothing of a surface.
constexpr double kGrazing = 0.25;

/// Removes a hit from every cell that the keyframe refutes: each of the four grid nodes around its projection either
/// measures depth more than `margin` metres (plus noise) behind the plane, or is nearer than that and shows another
/// plane than `own` (wall and recessed door look like one slanted surface from afar, and are two from near). The plane
/// must be seen from its own side and not at a grazing angle. Returns the number of such cells.
int clearRefuted(const DepthGrid& grid, const SurfaceLabels& labels, int own, const CameraModel& camera,
                 const DepthNoise& noise, const SE3& T_map_C, double margin, PlaneTrack* track);

/// Whether a covered cell lies in the image, within the depth's range and seen from the plane's own side.
bool showsIn(const PlaneTrack& track, const CameraModel& camera, const DepthNoise& noise, const SE3& T_map_C);

/// Whether the covered area's bounds may be in front of the camera within `range` metres.
bool mayBeInView(const PlaneTrack& track, const SE3& T_map_C, double range);

}  // namespace vip_slam
