// Whether an image shows another surface where a plane is said to be.
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

enum class PlaneVerdict {
  kNone,     ///< too little of it is in view
  kFor,      ///< it is there
  kAgainst,  ///< another surface is
};

/// What looks like one surface from afar, where depth scatters by more than the step between a door and its wall or the
/// rise of a ramp, is from near another one. Evidence against a plane: the triangles in most of its covered cells, near
/// enough to belong to it and whatever way they face, lie on a surface that is turned against it by more than
/// detection.max_tilt_deg and noise. Triangles from one plane of `all` (those in view, `track` among them) to another
/// tell nothing.
PlaneVerdict planeVerdict(const std::vector<MapTriangle>& triangles, const PlaneTrack& track,
                          const std::vector<const PlaneTrack*>& all, const PlaneDetectionOptions& detection,
                          const PlaneGrowthOptions& growth);

}  // namespace vip_slam
