// Decides whether two planes of the map are one surface (paper section "Plane Detection and Merging").
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// Requires the same kind and side, normals within the angle, boundary points near each other's plane where the areas
/// meet, and then either a shared area, or a gap that is small for their size and a joint fit that suits both. Pieces
/// next to each other may differ by more if the noise of their depth explains it; between pieces further apart no
/// keyframe may see anything behind their plane. The plane offsets d are not compared, since their difference grows
/// with the distance from the origin. `known`: all planes of the map, to check whether anything is above a ceiling.
bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known,
                 const SceneView& view, const PlaneMergingOptions& options);

/// What one plane for both adds to the distances of their points, RMS of the worse of both, m; infinity when they do not
/// determine a plane.
double jointMisfit(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses);

}  // namespace vip_slam
