// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/mesh/map_triangles.h"

namespace vip_slam {

std::vector<MapTriangle> placeMesh(const DepthMesh& mesh, const SE3& T_map_C) {
  const Eigen::Matrix3d R = T_map_C.R();
  std::vector<Eigen::Vector3d> points;
  points.reserve(mesh.vertices.size());
  for (const MeshVertex& v : mesh.vertices) points.push_back(R * v.p_C.cast<double>() + T_map_C.t());
  std::vector<MapTriangle> placed;
  placed.reserve(mesh.triangles.size());
  for (const MeshTriangle& t : mesh.triangles) {
    placed.push_back({{points[t.vertex[0]], points[t.vertex[1]], points[t.vertex[2]]},
                      t.vertex,
                      t.neighbour,
                      R * t.n_C.cast<double>(),
                      R * t.centre_C.cast<double>() + T_map_C.t(),
                      double(t.area),
                      double(t.sigma),
                      double(t.sigma_angle)});
  }
  return placed;
}

MapTriangle moved(const SE3& T, MapTriangle t) {
  for (Eigen::Vector3d& p : t.corner) p = T * p;
  t.centre = T * t.centre;
  t.n = T.rotation() * t.n;
  return t;
}

}  // namespace vip_slam
