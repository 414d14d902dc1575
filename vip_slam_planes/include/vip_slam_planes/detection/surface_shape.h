// SPDX-License-Identifier: BSD-3-Clause
// Shape tests of whether a set of mesh triangles is one flat surface. `surface`: ascending indices into the triangles,
// not empty.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// False for strips. Triangles that span a step between two surfaces form strips one triangle wide: all their vertices
/// lie on the strip's border, those of a true surface mostly inside. An upright surface of three columns has only the
/// middle one inside: the other two may belong to its neighbours, but determine its direction. It counts as a strip,
/// too.
bool isSolid(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface);

/// A strip of a round column passes as a plane by its distances and normals; a quadric fit distinguishes them. True
/// when the surface is significantly curved, or too narrow for its noise to exclude a column (a nearer view can).
/// sigma: of the distances to the plane in addition to the triangles' own, metres.
bool isCurved(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
              double sigma);

/// Depth noise can hide a step from the mesh, which then continues across it like a surface seen at a flat angle. True
/// when an upright surface is seen from `camera` at such an angle, and its depth range is not larger than a step that
/// noise may hide.
bool mayBeAStep(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& camera);

/// A plane fitted across a step, such as wall and recessed door, leans against both: the triangles' normals are those
/// of the two surfaces. Tests the median lean of the normals, since those on the step itself lean the other way. `axis`
/// (unit, in the plane): direction in which the fit could lean; `tolerance`, radians, is added to the normals' own
/// uncertainty.
bool facetsLean(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& axis, double tolerance);

}  // namespace vip_slam
