// SPDX-License-Identifier: BSD-3-Clause
// Tests whether an image shows another surface at the place of a plane.
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

enum class PlaneVerdict {
  kNone,     ///< too little of the plane is in view
  kFor,      ///< the image shows the plane
  kAgainst,  ///< the image shows another surface there
};

/// From afar, where depth noise exceeds the step between a door and its wall or the rise of a ramp, two surfaces can
/// look like one plane that a near view does not confirm. Evidence against a plane: the triangles over at least half of
/// its area, near enough to belong to it and facing roughly its way, lie on a surface that is turned against it by more
/// than detection.max_tilt_deg and noise. Triangles that span two planes of `all` (those in view, including `track`)
/// are not used.
PlaneVerdict planeVerdict(const std::vector<MapTriangle>& triangles, const PlaneTrack& track,
                          const std::vector<const PlaneTrack*>& all, const PlaneDetectionOptions& detection,
                          const PlaneGrowthOptions& growth);

}  // namespace vip_slam
