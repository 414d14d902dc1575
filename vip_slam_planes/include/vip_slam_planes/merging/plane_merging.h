// SPDX-License-Identifier: BSD-3-Clause
// Decides whether two planes of the map are one surface (paper section "Plane Detection and Merging").
#pragma once

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// One rule: coplanar, and no view through the gap. Requires the same kind and side, normals within the angle, no
/// keyframes that show both at two depths, and boundary points near each other's plane where the areas meet, up to
/// twice as far where the noise of their depth explains it, or any distance where they cover the same area and are
/// apart by less than single images err. Surfaces that cover the same area are then one. So are others that one plane
/// fits; when a gap divides them, the wider it is and the smaller the pieces are the better they must agree, since as
/// many more planes are level with one by chance. Level surfaces, which are made of one height, are one only when no
/// keyframe sees anything below the gap. The plane offsets d are not compared, since their difference grows with the
/// distance from the origin.
bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const SceneView& view, const PlaneMergingOptions& options);

/// What one plane for both adds to the distances of their points, RMS of the worse of both, m; infinity when they do
/// not determine a plane.
double jointMisfit(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses);

}  // namespace vip_slam
