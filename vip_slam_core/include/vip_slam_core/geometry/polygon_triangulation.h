// SPDX-License-Identifier: BSD-3-Clause
// Triangles of a plane's polygon with holes, for drawing and for meshes.
#pragma once

#include <array>
#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Ear clipping, after each hole has been joined to the outline by a bridge. Triangles turn counter-clockwise seen from
/// the side the normal points to. A ring may have either orientation; one of fewer than three points gives nothing.
/// Rings that cross themselves give some triangulation, never an endless loop. Quadratic in the number of points.
std::vector<Triangle> triangulate(const PlanePolygon& polygon, const Plane& plane);

}  // namespace vip_slam
