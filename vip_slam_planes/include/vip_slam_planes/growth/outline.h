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

/// Pieces of cells with at least min_hits, 4-connected; those below min_area and holes below min_hole (m^2) are left
/// out. `tolerance` (metres) bounds how far the simplified rings stray.
std::vector<Outline> traceOutlines(const CellGrid& grid, double cell, int min_hits, double min_area, double min_hole,
                                   double tolerance);

/// Signed area, positive when counter-clockwise.
double ringArea(const Ring2d& ring);
/// Even-odd rule; the border may fall either way.
bool ringContains(const Ring2d& ring, const Eigen::Vector2d& p);

}  // namespace vip_slam
