// SPDX-License-Identifier: BSD-3-Clause
// Plane labels of the nodes of a keyframe's depth grid.
#pragma once

#include <vector>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_planes/mesh/depth_mesh.h"

namespace vip_slam {

struct SurfaceLabels {
  int stride = 0, offset = 0, cols = 0, rows = 0;
  std::vector<int> label;  ///< -1: none

  int at(int c, int r) const {
    return c < 0 || r < 0 || c >= cols || r >= rows ? -1 : label[std::size_t(r) * cols + c];
  }
  /// The only label of the four nodes around a pixel when at least two have it, else -1.
  int around(const Eigen::Vector2f& pixel) const;
  struct Node {
    int label;
    Eigen::Vector2f pixel;
  };
  /// The labelled ones of the four nodes around a pixel.
  std::vector<Node> nodesAround(const Eigen::Vector2f& pixel) const;
  /// The label of a node whose eight neighbours have it too, else -1: a margin of one stride to every border.
  int inner(int c, int r) const;
};

/// Transfers the labels of the 2D triangles to the nodes that they cover.
SurfaceLabels labelNodes(const DepthMesh& mesh, const std::vector<int>& triangle_label, const DepthGrid& grid);

}  // namespace vip_slam
