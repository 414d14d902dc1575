// SPDX-License-Identifier: BSD-3-Clause
#include "plane_extent.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace vip_slam {
namespace {

double meanHeight(const PlaneTrack& track) {
  double sum = 0;
  track.cells().forEach([&](CellIndex c, int) { sum += track.cellCentre(c).z(); });
  return sum / track.cells().count(1);
}

}  // namespace

Contact contact(const PlaneTrack& small, const PlaneTrack& large, double gap) {
  Contact result;
  const int reach = static_cast<int>(std::ceil(gap / large.cellSize()));
  small.cells().forEach([&](CellIndex c, int) {
    ++result.cells;
    const Eigen::Vector3d p = small.cellCentre(c);
    const bool border = small.cells().isBorder(c);
    if (border) result.worst_border = std::max(result.worst_border, std::abs(large.plane().signedDistance(p)));
    const CellIndex there = large.cellAt(large.toPlane(p));
    if (large.cells().at(there)) {
      ++result.shared;
      ++result.near;
      const double off = std::abs(small.plane().signedDistance(large.cellCentre(there)));
      result.worst_meeting = std::max(result.worst_meeting, off);
      result.separation += std::abs(large.plane().signedDistance(p));
    } else if (border && (result.near < 8 || c.x % 4 == 0) && large.cells().near(there, reach)) {
      ++result.near;  // only a sample once contact is certain, since the search around a cell is expensive
    }
  });
  if (result.shared) result.separation /= result.shared;
  return result;
}

double boundsGap(const PlaneTrack& small, const PlaneTrack& large) {
  const CellGrid &s = small.cells(), &l = large.cells();
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
  for (int corner = 0; corner < 4; ++corner) {
    const CellIndex c{s.x0() + (corner & 1) * s.width(), s.y0() + (corner >> 1) * s.height()};
    const Eigen::Vector2d q = large.toPlane(small.cellCentre(c)) / large.cellSize();
    low = low.cwiseMin(q), high = high.cwiseMax(q);
  }
  const double dx = std::max({low.x() - (l.x0() + l.width()), l.x0() - high.x(), 0.0});
  const double dy = std::max({low.y() - (l.y0() + l.height()), l.y0() - high.y(), 0.0});
  return std::hypot(dx, dy) * large.cellSize();
}

double heightDifference(const PlaneTrack& a, const PlaneTrack& b) { return std::abs(meanHeight(a) - meanHeight(b)); }

}  // namespace vip_slam
