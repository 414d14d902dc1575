// SPDX-License-Identifier: BSD-3-Clause
// Surfaces that one image shows at two depths are separate, even if both are near enough to one plane to join it.
#pragma once

#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// Removes the label from triangles that lie on another layer than those nearest to their plane: a board 4 cm in front
/// of a wall is a separate surface. A pose error moves all layers alike and removes no label. `label`: from
/// associateTriangles(). `min_step`: between layers, m. Returns the plane that each triangle is another layer of, 0:
/// none.
std::vector<PlaneId> releaseOtherLayers(const std::vector<MapTriangle>& triangles,
                                        const std::vector<const PlaneTrack*>& tracks, double min_step,
                                        std::vector<int>* label);

}  // namespace vip_slam
