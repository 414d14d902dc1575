#include "plane_extent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace vip_slam {
namespace {

constexpr double kStrip = 4.0;  // length over width

/// The directions across and along a plane's area, in its own frame.
Eigen::Matrix2d mainAxes(const PlaneTrack& track) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  track.cells().forEach([&](CellIndex c, int) {
    const Eigen::Vector2d q(c.x, c.y);
    sum += q;
    squares += q * q.transpose();
  });
  const double n = track.cells().count(1);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(squares / n - sum * sum.transpose() / (n * n)).eigenvectors();
}

/// Bounds of a plane's cell centres along axes of another one's frame, without the outermost twentieth on each side, so
/// that a few wrong cells at its rim do not make a strip wide.
Eigen::AlignedBox2d boundsAlong(const PlaneTrack& track, const PlaneTrack& frame, const Eigen::Matrix2d& axes) {
  std::vector<double> along[2];
  track.cells().forEach([&](CellIndex c, int) {
    const Eigen::Vector2d q = axes.transpose() * frame.toPlane(track.cellCentre(c));
    for (int k = 0; k < 2; ++k) along[k].push_back(q(k));
  });
  Eigen::AlignedBox2d bounds;
  for (int k = 0; k < 2; ++k) {
    std::sort(along[k].begin(), along[k].end());
    const std::size_t out = along[k].size() / 20;
    bounds.min()(k) = along[k][out];
    bounds.max()(k) = along[k][along[k].size() - 1 - out];
  }
  return bounds;
}

double meanHeight(const PlaneTrack& track) {
  double sum = 0;
  track.cells().forEach([&](CellIndex c, int) { sum += track.cellCentre(c).z(); });
  return sum / track.cells().count(1);
}

/// Range of a surface's heights from `level` in direction `out`, from the corners of its grid, where they are extreme.
std::pair<double, double> heightRange(const PlaneTrack& track, double out, double level) {
  const CellGrid& grid = track.cells();
  std::pair<double, double> range = {1e300, -1e300};
  for (const int x : {grid.x0(), grid.x0() + grid.width() - 1}) {
    for (const int y : {grid.y0(), grid.y0() + grid.height() - 1}) {
      const double height = out * (track.cellCentre({x, y}).z() - level);
      range = {std::min(range.first, height), std::max(range.second, height)};
    }
  }
  return range;
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

double lengthIfContinued(const PlaneTrack& small, const PlaneTrack& large) {
  const Eigen::Matrix2d axes = mainAxes(large);
  const Eigen::AlignedBox2d strip = boundsAlong(large, large, axes), piece = boundsAlong(small, large, axes);
  const double cell = large.cellSize();
  const double length = strip.sizes().y() + cell, width = strip.sizes().x() + cell;
  const bool between = piece.min().x() > strip.min().x() - 1.5 * cell && piece.max().x() < strip.max().x() + 1.5 * cell;
  return between && length > kStrip * width ? length : 0.0;
}

double heightDifference(const PlaneTrack& a, const PlaneTrack& b) { return std::abs(meanHeight(a) - meanHeight(b)); }

bool outermost(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known) {
  constexpr double kBeside = 0.5, kBeyond = 0.3;  // m; walls end a cell or two above or below a ceiling
  const bool ceiling = a.plane().n.z() < 0;
  const double out = ceiling ? 1.0 : -1.0, level = 0.5 * (meanHeight(a) + meanHeight(b));
  Eigen::AlignedBox2d piece[2], all;
  for (int k = 0; k < 2; ++k) {
    const PlaneTrack& track = k ? b : a;
    track.cells().forEach([&](CellIndex c, int) { piece[k].extend(track.cellCentre(c).head<2>()); });
    piece[k].min().array() -= kBeside;
    piece[k].max().array() += kBeside;
    all.extend(piece[k]);
  }
  bool meets[2] = {false, false}, beyond = false;
  for (const PlaneTrack* track : known) {
    // Tables of one height are tested in many pairs: reject a floor below them without visiting its cells.
    const auto [lowest, highest] = heightRange(*track, out, level);
    if (highest < -kBeyond) continue;
    if (lowest > kBeyond && !ceiling && track->cells().count(1) > 0) return false;
    const bool wall = track->kind() == PlaneKind::kVertical && track->area() >= kLargeWall;
    track->cells().forEach([&](CellIndex c, int) {
      const Eigen::Vector3d p = track->cellCentre(c);
      const double height = out * (p.z() - level);
      if (height < -kBeyond) return;
      const Eigen::Vector2d q = p.head<2>();
      beyond = beyond || (height > kBeyond && (!ceiling || all.contains(q)));
      for (int k = 0; wall && k < 2; ++k) meets[k] = meets[k] || piece[k].contains(q);
    });
    if (beyond) return false;
  }
  return meets[0] && meets[1];
}

}  // namespace vip_slam
