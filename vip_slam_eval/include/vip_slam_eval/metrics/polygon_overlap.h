// SPDX-License-Identifier: BSD-3-Clause
// Areas of polygons with holes and of their intersection, in the coordinates of a plane.
#pragma once

#include <vector>

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Disjoint pieces with holes, projected along the normal into a plane's 2D coordinates.
class FlatRegion {
 public:
  FlatRegion(const std::vector<PlanePolygon>& polygons, const Plane& plane);

  double area() const;  ///< m^2
  bool contains(const Eigen::Vector2d& p) const;
  /// Area of the intersection of two regions of the same plane, by scan lines `step` metres apart.
  static double overlap(const FlatRegion& a, const FlatRegion& b, double step = 0.02);

  const std::vector<std::vector<Eigen::Vector2d>>& rings() const { return rings_; }

 private:
  /// Ascending x of a scan line's crossings with the rings; between the 1st and 2nd, 3rd and 4th, ... is inside.
  std::vector<double> crossings(double y) const;

  std::vector<std::vector<Eigen::Vector2d>> rings_;
  double min_y_ = 0, max_y_ = 0;
};

/// Coordinates of x in the plane: origin at the projection of the world's origin, axes tangentBasis(n).
Eigen::Vector2d planeCoordinates(const Plane& plane, const Eigen::Vector3d& x);

}  // namespace vip_slam
