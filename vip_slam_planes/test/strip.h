// SPDX-License-Identifier: BSD-3-Clause
// Test support: a narrow face as a keyframe's mesh shows it.
#pragma once

#include <cmath>
#include <vector>

#include "vip_slam_planes/detection/plane_detector.h"

namespace vip_slam::testing {

/// A strip 0.4 m wide and 2 m high that starts at (3, 0, 0.5) and runs `azimuth` from the x axis; it faces +y.
inline std::vector<MapTriangle> strip(double azimuth, double sigma) {
  const Eigen::Vector3d along(std::cos(azimuth), std::sin(azimuth), 0), n(-std::sin(azimuth), std::cos(azimuth), 0);
  std::vector<MapTriangle> triangles;
  const auto at = [&](double u, double z) -> Eigen::Vector3d { return Eigen::Vector3d(3, 0, 0.5 + z) + u * along; };
  for (int r = 0; r < 10; ++r) {
    for (const bool upper : {false, true}) {
      MapTriangle t;
      t.corner = {at(upper ? 0.4 : 0, 0.2 * r + (upper ? 0.2 : 0)), at(0.4, 0.2 * r), at(0, 0.2 * r + 0.2)};
      t.vertex = {0, 0, 0}, t.neighbour = {-1, -1, -1};
      t.n = n;
      t.centre = (t.corner[0] + t.corner[1] + t.corner[2]) / 3;
      t.area = 0.04, t.sigma = sigma, t.sigma_angle = 0.05;
      triangles.push_back(t);
    }
  }
  return triangles;
}

/// All of these triangles as detectPlanes() returns a strip.
inline DetectedPlane foundStrip(const std::vector<MapTriangle>& triangles) {
  DetectedPlane found;
  found.kind = PlaneKind::kVertical;
  for (const MapTriangle& t : triangles) found.centroid += t.centre / double(triangles.size());
  found.plane = Plane::fromPointNormal(found.centroid, triangles.front().n);
  for (std::size_t i = 0; i < triangles.size(); ++i) found.triangles.push_back(static_cast<int>(i));
  return found;
}

}  // namespace vip_slam::testing
