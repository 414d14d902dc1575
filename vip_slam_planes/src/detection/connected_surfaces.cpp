// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/connected_surfaces.h"

#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace vip_slam {

std::vector<std::vector<int>> connectedSurfaces(const std::vector<MapTriangle>& triangles,
                                                const std::vector<int>& members, const Plane& plane,
                                                const Eigen::Vector3d& origin, double side) {
  const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
  const auto key = [](std::int64_t x, std::int64_t y) { return (x << 32) ^ (y & 0xffffffff); };
  struct Cell {
    std::int64_t x, y;
    int part;  ///< -1: open
  };
  std::vector<Cell> cells;
  std::unordered_map<std::int64_t, int> cell_at;
  std::vector<int> cell_of;
  for (int i : members) {
    const Eigen::Vector2d q = basis.transpose() * (triangles[i].centre - origin) / side;
    const auto x = static_cast<std::int64_t>(std::floor(q.x())), y = static_cast<std::int64_t>(std::floor(q.y()));
    // Triangles are in mesh order: the next one is often in the same cell.
    if (cell_of.empty() || cells[cell_of.back()].x != x || cells[cell_of.back()].y != y) {
      const auto [it, fresh] = cell_at.emplace(key(x, y), static_cast<int>(cells.size()));
      if (fresh) cells.push_back({x, y, -1});
      cell_of.push_back(it->second);
    } else {
      cell_of.push_back(cell_of.back());
    }
  }
  std::vector<std::vector<int>> parts;
  std::vector<int> queue;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (cells[cell_of[i]].part < 0) {
      const int part = static_cast<int>(parts.size());
      parts.emplace_back();
      cells[cell_of[i]].part = part;
      queue.assign(1, cell_of[i]);
      while (!queue.empty()) {
        const Cell cell = cells[queue.back()];
        queue.pop_back();
        for (int k = 0; k < 9; ++k) {
          const auto near = cell_at.find(key(cell.x + k % 3 - 1, cell.y + k / 3 - 1));
          if (near == cell_at.end() || cells[near->second].part >= 0) continue;
          cells[near->second].part = part;
          queue.push_back(near->second);
        }
      }
    }
    parts[cells[cell_of[i]].part].push_back(members[i]);
  }
  return parts;
}

}  // namespace vip_slam
