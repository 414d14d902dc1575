// When two planes of the map are one surface (paper section "Plane Merging").
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// Same kind and side, within the angle, boundary points near each other's plane where the areas meet, and then either
/// a shared area, or a gap that suits their size and a joint fit that serves both. Pieces beside each other may differ
/// by more where the noise of their depth explains it; pieces that are further apart must not show anything behind
/// their plane between them. The plane offsets d are not compared: their difference grows
/// with the distance from the origin. `known` are all planes of the map, which tell whether a ceiling has anything
/// above it.
bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known,
                 const SceneView& view, const PlaneMergingOptions& options);

}  // namespace vip_slam
