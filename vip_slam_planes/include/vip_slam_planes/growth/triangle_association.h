// SPDX-License-Identifier: BSD-3-Clause
// Association of the triangles of a placed mesh with known planes (paper: 10 degrees, 5 cm).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// Largest angle between a triangle's normal and a plane's: the option, widened where noise makes normals uncertain.
class AngleGate {
 public:
  explicit AngleGate(double angle_deg);
  double angle(const MapTriangle& triangle) const { return std::clamp(2.0 * triangle.sigma_angle, narrow_, wide_); }
  /// Its cosine; for most triangles the angle is at one of its limits, and the cosine is cached.
  double cosine(const MapTriangle& triangle) const {
    const double gate = angle(triangle);
    return gate == narrow_ ? cos_narrow_ : gate == wide_ ? cos_wide_ : std::cos(gate);
  }

 private:
  double narrow_, wide_, cos_narrow_, cos_wide_;
};
double distanceGate(const MapTriangle& triangle, double distance);

/// Index into `tracks` per triangle, -1: none. A connected patch of triangles joins only where it comes within
/// options.gap of the plane's covered area: planes are bounded surfaces, so two tables of one height are two planes.
/// `tracks` holds the planes that can be in view.
std::vector<int> associateTriangles(const std::vector<MapTriangle>& triangles,
                                    const std::vector<const PlaneTrack*>& tracks, const PlaneGrowthOptions& options);

}  // namespace vip_slam
