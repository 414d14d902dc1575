// SPDX-License-Identifier: BSD-3-Clause
// The surfaces that triangles of one plane consist of: a wall on either side of a door is two.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// Splits the triangles `members`, all on `plane`, into connected parts: cells of `side` m on the plane that have
/// triangles, joined with their eight neighbours. `origin`: of the cells, in the triangles' frame.
std::vector<std::vector<int>> connectedSurfaces(const std::vector<MapTriangle>& triangles,
                                                const std::vector<int>& members, const Plane& plane,
                                                const Eigen::Vector3d& origin, double side);

}  // namespace vip_slam
