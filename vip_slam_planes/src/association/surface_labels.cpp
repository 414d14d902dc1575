// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/association/surface_labels.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

// The first index at or after `at`, not below zero.
int firstNode(float at) {
  const int i = std::max(0, static_cast<int>(at));
  return float(i) < at ? i + 1 : i;
}

}  // namespace

int SurfaceLabels::around(const Eigen::Vector2f& pixel) const {
  if (stride == 0) return -1;
  const int c = static_cast<int>(std::floor((pixel.x() - float(offset)) / float(stride)));
  const int r = static_cast<int>(std::floor((pixel.y() - float(offset)) / float(stride)));
  int shared = -1, count = 0;
  for (int i = 0; i < 4; ++i) {
    const int k = at(c + (i & 1), r + (i >> 1));
    if (k < 0) continue;
    if (shared >= 0 && k != shared) return -1;
    shared = k;
    ++count;
  }
  return count >= 2 ? shared : -1;
}

std::vector<SurfaceLabels::Node> SurfaceLabels::nodesAround(const Eigen::Vector2f& pixel) const {
  std::vector<Node> nodes;
  if (stride == 0) return nodes;
  const int c = static_cast<int>(std::floor((pixel.x() - float(offset)) / float(stride)));
  const int r = static_cast<int>(std::floor((pixel.y() - float(offset)) / float(stride)));
  for (int i = 0; i < 4; ++i) {
    const int col = c + (i & 1), row = r + (i >> 1), k = at(col, row);
    if (k >= 0) nodes.push_back({k, Eigen::Vector2f(float(offset + col * stride), float(offset + row * stride))});
  }
  return nodes;
}

int SurfaceLabels::inner(int c, int r) const {
  const int k = at(c, r);
  if (k < 0) return -1;
  for (int dr = -1; dr <= 1; ++dr) {
    for (int dc = -1; dc <= 1; ++dc) {
      if (at(c + dc, r + dr) != k) return -1;
    }
  }
  return k;
}

SurfaceLabels labelNodes(const DepthMesh& mesh, const std::vector<int>& triangle_label, const DepthGrid& grid) {
  SurfaceLabels labels;
  labels.stride = grid.stride, labels.offset = grid.offset, labels.cols = grid.cols, labels.rows = grid.rows;
  labels.label.assign(grid.z.size(), -1);
  if (grid.empty()) return labels;
  const float stride = float(grid.stride), offset = float(grid.offset);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (triangle_label[i] < 0) continue;
    const Eigen::Vector2f& a = mesh.vertices[mesh.triangles[i].vertex[0]].pixel;
    const Eigen::Vector2f& b = mesh.vertices[mesh.triangles[i].vertex[1]].pixel;
    const Eigen::Vector2f& c = mesh.vertices[mesh.triangles[i].vertex[2]].pixel;
    const Eigen::Vector2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const int c0 = firstNode((low.x() - offset) / stride), r0 = firstNode((low.y() - offset) / stride);
    const int c1 = std::min(grid.cols - 1, static_cast<int>((high.x() - offset) / stride));
    const int r1 = std::min(grid.rows - 1, static_cast<int>((high.y() - offset) / stride));
    const Eigen::Vector2f ab = b - a, bc = c - b, ca = a - c;
    for (int row = r0; row <= r1; ++row) {
      const float y = offset + float(row) * stride;
      const float up_ab = ab.x() * (y - a.y()), up_bc = bc.x() * (y - b.y()), up_ca = ca.x() * (y - c.y());
      int* node = &labels.label[std::size_t(row) * grid.cols];
      for (int col = c0; col <= c1; ++col) {
        const float x = offset + float(col) * stride;
        if (up_ab >= ab.y() * (x - a.x()) && up_bc >= bc.y() * (x - b.x()) && up_ca >= ca.y() * (x - c.x())) {
          node[col] = triangle_label[i];
        }
      }
    }
  }
  return labels;
}

}  // namespace vip_slam
