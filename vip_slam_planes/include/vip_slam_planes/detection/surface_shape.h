// What the shape of a set of mesh triangles tells about it being one flat surface. `surface`: ascending indices into
// the triangles, not empty.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

/// Triangles that span a step between two surfaces line up into strips one triangle wide: all their vertices lie on
/// the strip's border, those of a true surface mostly inside. Of an upright surface that shows in three columns only
/// the middle one is inside: the others may belong to its neighbours, and its direction hangs on them. It is a strip,
/// too.
bool isSolid(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface);

/// A strip of a round column passes for a plane by its distances and normals; a quadric tells them apart. True when
/// the surface bends for certain, or when it is too narrow for its noise to exclude a column: a nearer view will tell.
/// sigma: of the distances to the plane beyond the triangles' own, metres.
bool isCurved(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
              double sigma);

/// Depth noise hides steps from the mesh, which goes on across them, and a step looks like a surface seen at a flat
/// angle. True when an upright surface is seen from `camera` at such an angle, and all of it is no deeper than a step
/// that noise may hide.
bool mayBeAStep(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& camera);

/// A plane laid across a step, such as wall and door of a recess, leans against both: the facets of either one point
/// where that one points. Their median, as facets on the step itself lean the other way. `axis` (unit, in the plane)
/// is where the fit was free to lean; the tolerance, in radians, comes on top of the facets' own uncertainty.
bool facetsLean(const std::vector<MapTriangle>& triangles, const std::vector<int>& surface, const Plane& plane,
                const Eigen::Vector3d& axis, double tolerance);

}  // namespace vip_slam
