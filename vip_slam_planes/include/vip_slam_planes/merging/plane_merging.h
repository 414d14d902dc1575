// When two planes of the map are one surface (paper section "Plane Merging").
#pragma once

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// Same kind and side, within the angle, boundary points near each other's plane where the areas meet, and then either
/// a shared area, or a gap that suits their size and a joint fit that serves both. The plane offsets d are not
/// compared: their difference grows with the distance from the origin.
bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses,
                 const PlaneMergingOptions& options);

}  // namespace vip_slam
