// SPDX-License-Identifier: BSD-3-Clause
// Polygons with holes from covered cells: the borders between covered and uncovered cells, traced along the cells'
// sides and simplified.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_planes/growth/cell_grid.h"

namespace vip_slam {

using Ring2d = std::vector<Eigen::Vector2d>;

struct Outline {
  Ring2d outer;               ///< counter-clockwise
  std::vector<Ring2d> holes;  ///< clockwise
};

/// Outlines of the 4-connected pieces of cells with at least min_hits; pieces below min_area and holes below min_hole
/// (m^2) are left out. `tolerance` (metres) bounds the deviation of the simplified rings.
std::vector<Outline> traceOutlines(const CellGrid& grid, double cell, int min_hits, double min_area, double min_hole,
                                   double tolerance);

/// Signed area, positive when counter-clockwise.
double ringArea(const Ring2d& ring);
/// Even-odd rule; points on the border may count either way.
bool ringContains(const Ring2d& ring, const Eigen::Vector2d& p);

}  // namespace vip_slam
