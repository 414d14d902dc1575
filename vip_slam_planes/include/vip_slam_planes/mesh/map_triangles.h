// SPDX-License-Identifier: BSD-3-Clause
// A depth mesh placed in `map`.
#pragma once

#include <array>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_planes/mesh/depth_mesh.h"

namespace vip_slam {

struct MapTriangle {
  std::array<Eigen::Vector3d, 3> corner;  ///< metres
  std::array<int, 3> vertex;              ///< of the mesh
  std::array<int, 3> neighbour;           ///< -1: none
  Eigen::Vector3d n;                      ///< unit, towards the camera
  Eigen::Vector3d centre;
  double area;         ///< m^2
  double sigma;        ///< of the distance along n, metres
  double sigma_angle;  ///< of the normal, radians
};

/// Of a triangle in a fit: by area, so that dense features do not dominate, and by noise, so that the far end does not.
inline double fitWeight(const MapTriangle& triangle) {
  const double sigma = triangle.sigma + 0.005;
  return triangle.area / (sigma * sigma);
}

std::vector<MapTriangle> placeMesh(const DepthMesh& mesh, const SE3& T_map_C);
/// A triangle in the frame that T maps into.
MapTriangle moved(const SE3& T, MapTriangle triangle);

}  // namespace vip_slam
