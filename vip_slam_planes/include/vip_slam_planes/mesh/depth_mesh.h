// SPDX-License-Identifier: BSD-3-Clause
// The image's Delaunay mesh lifted to 3D by depth (paper section "Plane Detection"), in the camera's optical frame.
//
// The paper triangulates the features alone. White walls, which are most useful against drift, have none; so nodes of
// the grid of edge-safe depths are added wherever no feature with depth is near: coarsely on flat blocks, every node
// close to depth edges. Triangles that cross a depth edge, are long and thin, or are seen at a grazing angle are
// dropped.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_planes/mesh/delaunay.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

struct MeshVertex {
  Eigen::Vector2f pixel;
  Eigen::Vector3f p_C;  ///< metres
  int feature = -1;     ///< index in the features; -1: a grid node
};

struct MeshTriangle {
  std::array<int, 3> vertex;
  std::array<int, 3> neighbour;  ///< neighbouring triangles of the mesh; -1: none
  Eigen::Vector3f n_C;           ///< unit, towards the camera, averaged with neighbours of the same surface
  Eigen::Vector3f centre_C;
  float area;         ///< m^2
  float sigma;        ///< one sigma of the distance along n, metres
  float sigma_angle;  ///< one sigma of the normal, radians
};

struct DepthMesh {
  std::vector<MeshVertex> vertices;
  std::vector<MeshTriangle> triangles;
};

/// Rays (x, y) with z = 1 of the nodes of a depth grid; NaN where the pixel has none.
class GridRays {
 public:
  explicit GridRays(std::shared_ptr<const CameraModel> camera) : camera_(std::move(camera)) {}
  /// Cached for two layouts, the grids of keyframes and the coarser ones of frames, which alternate. The result is
  /// valid until the next but one call.
  const std::vector<Eigen::Vector2f>& operator()(const DepthGrid& grid, const BearingCorrection& bearing = {});

 private:
  struct Layout {
    int stride = 0, offset = 0, cols = 0, rows = 0;
    std::vector<Eigen::Vector2f> given;  // with the configured intrinsics
    BearingCorrection bearing;
    std::vector<Eigen::Vector2f> rays;  // `given` corrected by `bearing`
  };
  const std::vector<Eigen::Vector2f>& corrected(Layout* layout, const BearingCorrection& bearing);

  std::shared_ptr<const CameraModel> camera_;
  std::array<Layout, 2> layouts_;
  std::size_t last_ = 0;
};

class DepthMeshBuilder {
 public:
  DepthMeshBuilder(const PlaneMeshOptions& options, std::shared_ptr<const CameraModel> camera, const DepthNoise& noise);
  /// The result is valid until the next call. The grid may be empty. `up_C`: the world's z axis in the camera frame;
  /// horizontal surfaces may be seen at a flatter angle than upright ones, which may be just a step in depth.
  /// `bearing`: correction of the camera's bearings; the features are already corrected.
  const DepthMesh& build(const std::vector<Feature>& features, const DepthGrid& grid, const Eigen::Vector3d& up_C,
                         const BearingCorrection& bearing = {});

 private:
  void collectVertices(const std::vector<Feature>& features, const DepthGrid& grid);
  /// Whether a side is longer than the spacing of the grid's nodes.
  bool skipsNodes(const DelaunayTriangle& flat, const DepthGrid& grid) const;
  bool lift(const DelaunayTriangle& flat, const DepthGrid& grid, int step, MeshTriangle* triangle) const;
  bool flatBlock(const DepthGrid& grid, int c, int r, int step) const;
  bool crossesDepthEdge(const MeshTriangle& triangle, const DepthGrid& grid) const;
  bool brokenBetween(const MeshVertex& a, const MeshVertex& b, const DepthGrid& grid) const;
  void smoothNormals();
  double spacing() const;  ///< of the mesh's nodes, px of this camera
  int gridStep(const DepthGrid& grid) const;

  PlaneMeshOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  DepthNoise noise_;
  float least_facing_, least_level_facing_;  ///< cosine of the angle between normal and viewing ray
  Eigen::Vector3f up_C_;
  GridRays rays_;
  const std::vector<Eigen::Vector2f>* grid_rays_ = nullptr;
  Delaunay delaunay_;
  DepthMesh mesh_;
  std::vector<Eigen::Vector2f> pixels_;
  std::vector<char> taken_, used_;
  std::vector<int> number_;
  std::vector<Eigen::Vector3f> smoothed_;
};

}  // namespace vip_slam
