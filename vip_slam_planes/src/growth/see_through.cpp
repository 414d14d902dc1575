// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/see_through.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vip_slam_core/depth/sight.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

struct CellBox {
  CellIndex first, last;
};

// Bounds of the cells that may lie in the image within `range` along its axis, from the view's pyramid projected onto
// the plane: a floor has tens of thousands of cells, an image shows a few hundred.
CellBox cellsInView(const PlaneTrack& track, const CameraModel& camera, const SE3& T_map_C, double range) {
  const CellGrid& cells = track.cells();
  const CellBox all{{cells.x0(), cells.y0()}, {cells.x0() + cells.width() - 1, cells.y0() + cells.height() - 1}};
  Eigen::Vector2d low = track.toPlane(T_map_C.t()), high = low;
  for (int k = 0; k < 9; ++k) {
    Eigen::Vector2d xy;
    const Eigen::Vector2d uv(0.5 * (k % 3) * camera.width(), 0.5 * (k / 3) * camera.height());
    if (!camera.undistort(uv - Eigen::Vector2d(0.5, 0.5), &xy)) return all;
    const Eigen::Vector2d q = track.toPlane(T_map_C * (range * Eigen::Vector3d(xy.x(), xy.y(), 1.0)));
    low = low.cwiseMin(q), high = high.cwiseMax(q);
  }
  return {track.cellAt(low), track.cellAt(high)};
}

}  // namespace

bool mayBeInView(const PlaneTrack& track, const SE3& T_map_C, double range) {
  const CellGrid& cells = track.cells();
  if (cells.empty() || track.plane().signedDistance(T_map_C.t()) < -0.1) return false;
  if (std::abs(track.plane().signedDistance(T_map_C.t())) > range) return false;
  // Nearest point of the bounds to the camera.
  const Eigen::Vector2d q = track.toPlane(T_map_C.t()) / track.cellSize();
  const double dx = std::max({cells.x0() - q.x(), 0.0, q.x() - (cells.x0() + cells.width())});
  const double dy = std::max({cells.y0() - q.y(), 0.0, q.y() - (cells.y0() + cells.height())});
  if (std::hypot(dx, dy) * track.cellSize() > range) return false;
  // Entirely behind the camera?
  const Eigen::Vector3d forward = T_map_C.R().col(2);
  for (int corner = 0; corner < 4; ++corner) {
    const CellIndex c{cells.x0() + (corner & 1) * cells.width(), cells.y0() + (corner >> 1) * cells.height()};
    if (forward.dot(track.cellCentre(c) - T_map_C.t()) > 0) return true;
  }
  return std::hypot(dx, dy) == 0;
}

bool showsIn(const PlaneTrack& track, const CameraModel& camera, const DepthNoise& noise, const SE3& T_map_C) {
  if (track.plane().signedDistance(T_map_C.t()) <= 0) return false;
  const SE3 T_C_map = T_map_C.inverse();
  bool shows = false;
  track.cells().forEach([&](CellIndex cell, int) {
    if (shows) return;
    const Eigen::Vector3d p = T_C_map * track.cellCentre(cell);
    Eigen::Vector2d uv;
    shows = noise.inRange(p.z()) && camera.project(p, &uv) && camera.inImage(uv);
  });
  return shows;
}

int clearRefuted(const DepthGrid& grid, const SurfaceLabels& labels, int own, const CameraModel& camera,
                 const DepthNoise& noise, const SE3& T_map_C, double margin, PlaneTrack* track) {
  if (grid.empty()) return 0;
  const SE3 T_C_map = T_map_C.inverse();
  const Eigen::Vector3d n_C = T_C_map.rotation() * track->plane().n;
  // Cells far behind all measured depth cannot be refuted.
  const double deepest = *std::max_element(grid.z.begin(), grid.z.end());
  const double range =
      std::min(noise.max_range, deepest + margin / kGrazing + kNoiseSigmas * noise.sigma(noise.max_range));
  const CellBox view = cellsInView(*track, camera, T_map_C, range);
  std::vector<CellIndex> refuted;
  // Centres are an affine function of the index.
  const Eigen::Vector3d p0 = T_C_map * track->cellCentre({0, 0});
  const Eigen::Vector3d px = T_C_map * track->cellCentre({1, 0}) - p0, py = T_C_map * track->cellCentre({0, 1}) - p0;
  track->cells().forEachIn(view.first, view.last, [&](CellIndex cell, int) {
    const Eigen::Vector3d p = p0 + cell.x * px + cell.y * py;
    if (p.z() < noise.min_range || p.z() > range || -n_C.dot(p) < kGrazing * p.norm()) return;
    const SightLine line = sightLine(grid, camera, p);
    if (line.measured < 4) return;
    const double facing = -n_C.dot(p) / p.z();  // |n . ray|
    const double slack = (margin + kNoiseSigmas * noise.sigma(p.z()) * facing) / facing;
    for (int k = 0; k < 4; ++k) {
      const int col = line.col + (k & 1), row = line.row + (k >> 1), label = labels.at(col, row);
      const double z = grid.at(col, row);
      const bool behind = z > p.z() + slack, another = z > p.z() - slack && label >= 0 && label != own;
      if (!behind && !another) return;
    }
    refuted.push_back(cell);
  });
  for (const CellIndex& cell : refuted) track->miss(cell);
  return static_cast<int>(refuted.size());
}

}  // namespace vip_slam
