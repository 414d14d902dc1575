#include "vip_slam_planes/merging/plane_merging.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace vip_slam {
namespace {

// Smaller walls and ceilings are furniture. What one can put things on stays apart until it is a floor: two tables are
// two.
constexpr double kLargeWall = 1.0, kLargeFloor = 4.0;  // m^2
constexpr double kFloor = 1.0;                         // m^2; of a level surface that is no thing on it
constexpr double kPartition = 0.5;     // m^2; free-standing walls and doors, of which something hides the middle
constexpr double kNoTable = 20.0;      // m^2; what lies level with so large a surface is more of it, not a second table
constexpr double kLeastCeiling = 4.0;  // m^2; no underside of furniture is as large, and none is level with a ceiling
// Nor has any walls that end at it and nothing above; no table has nothing below.
constexpr double kTopmostCeiling = 1.0, kLowestFloor = 0.5;  // m^2
// Ceilings are seen at the flattest angles and from afar, and nothing as wide hangs less than this below another one.
constexpr double kCeilingSlack = 1.5;              // of max_rms
constexpr double kStrip = 4.0, kLeastStrip = 1.0;  // length over width, m^2; boards of shelves are smaller
constexpr double kSmallGap = 4.0;                  // a smaller piece of a wall may be as many of its own widths away
constexpr double kHiddenGap = 4.0;      // m; as far as indoor depth reaches, a surface may go on where nobody looked
constexpr double kNoise = 11.3;         // of what noise does to two planes that are one (three degrees of freedom) 99 %
constexpr double kNoisyDistance = 2.0;  // as many times the distance when noise explains it
constexpr double kCloser = 4.0;         // as many times as far apart when they agree as many times better

// What the smaller plane's area looks like from the larger one.
struct Contact {
  int cells = 0, shared = 0, near = 0;
  double worst_border = 0;   ///< largest distance of a border point of the smaller to the larger plane
  double worst_meeting = 0;  ///< largest distance of a point of the larger, where they meet, to the smaller plane
  double separation = 0;     ///< mean distance where shared
};

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
      ++result.near;  // sampled once contact is certain: the search around a cell is not free
    }
  });
  if (result.shared) result.separation /= result.shared;
  return result;
}

// Distance between the bounds of the areas along the larger plane, metres; 0 when they overlap.
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

/// Bounds of the centres of a plane's cells along axes of another one's frame, without the twentieth part of them that
/// is farthest out on each side: a few cells of something else at its rim do not make a strip wide.
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

/// The length of the larger one when it is a long strip and the smaller one lies in its continuation, between the same
/// two edges; else 0.
double lengthIfContinued(const PlaneTrack& small, const PlaneTrack& large) {
  const Eigen::Matrix2d axes = mainAxes(large);
  const Eigen::AlignedBox2d strip = boundsAlong(large, large, axes), piece = boundsAlong(small, large, axes);
  const double cell = large.cellSize();
  const double length = strip.sizes().y() + cell, width = strip.sizes().x() + cell;
  const bool between = piece.min().x() > strip.min().x() - 1.5 * cell && piece.max().x() < strip.max().x() + 1.5 * cell;
  return between && length > kStrip * width ? length : 0.0;
}

double meanHeight(const PlaneTrack& track) {
  double sum = 0;
  track.cells().forEach([&](CellIndex c, int) { sum += track.cellCentre(c).z(); });
  return sum / track.cells().count(1);
}

double heightDifference(const PlaneTrack& a, const PlaneTrack& b) { return std::abs(meanHeight(a) - meanHeight(b)); }

/// How far out from a level all of a surface lies: heights of a plane are extreme at the corners of its grid.
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

/// Whether walls end at both pieces, and of all that is known beside them and between them nothing lies beyond. Over a
/// duct or a beam the walls go on, under a table as well; and nothing at all that is known may lie below a floor.
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
    // Many tables of one height are asked for in pairs: a floor below them is not walked cell by cell.
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

PlaneMoments surfaceMoments(const PlaneTrack& track, const CameraPoses& poses) {
  PlaneMoments moments = track.moments(poses);
  if (moments.weight() > 0) return moments;
  // A plane of a loaded map has no observations; its cells stand in for them.
  track.cells().forEach([&](CellIndex c, int) { moments.add(track.cellCentre(c), 1.0); });
  return moments;
}

bool jointFitServes(const PlaneMoments& a, const PlaneMoments& b, const PlaneTrack& track, double slack) {
  const PlaneMoments both{a.M + b.M};
  Plane joint, own;
  if (!fitPlane(both, track.kind(), track.plane().n, &joint)) return false;
  for (const PlaneMoments* m : {&a, &b}) {
    if (!fitPlane(*m, track.kind(), track.plane().n, &own)) return false;
    if (m->meanSquare(joint) > m->meanSquare(own) + slack * slack) return false;
  }
  return true;
}

/// Whether one plane through both is what the noise of their depth points allows. From afar that is centimetres and
/// degrees, which no fixed limit suits. Nothing is known of the noise of a loaded map's planes.
bool noiseAllowsOne(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses) {
  const PlaneMoments of_a = a.moments(poses), of_b = b.moments(poses);
  if (!(of_a.weight() > 0) || !(of_b.weight() > 0)) return false;
  Plane joint, own;
  if (!fitPlane({of_a.M + of_b.M}, a.kind(), a.plane().n, &joint)) return false;
  double excess = 0;
  for (const PlaneMoments* m : {&of_a, &of_b}) {
    if (!fitPlane(*m, a.kind(), a.plane().n, &own)) return false;
    excess += m->weight() * (m->meanSquare(joint) - m->meanSquare(own));
  }
  return excess < kNoise;
}

// Drift moves a keyframe as a whole: what one keyframe shows at two depths is two surfaces, whatever was covered from
// afar, where a door's recess or a board on the wall does not show.
bool shownApart(const PlaneTrack& small, const PlaneTrack& large, const CameraPoses& poses, double distance) {
  constexpr double kTilt = 0.005;  // rad, error of the larger plane's normal
  int apart = 0, together = 0;
  for (const auto& [keyframe, observation] : small.observations()) {
    const auto other = large.observations().find(keyframe);
    const auto pose = poses.find(keyframe);
    if (other == large.observations().end() || pose == poses.end()) continue;
    const Eigen::Vector3d n_C = pose->second.R().transpose() * large.plane().n;
    const Eigen::Vector3d between = PlaneMoments{observation.G}.centroid() - PlaneMoments{other->second.G}.centroid();
    const double off = std::abs(n_C.dot(between));
    ++(off > distance + kTilt * between.norm() ? apart : together);
  }
  return apart > together;
}

}  // namespace

bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known,
                 const SceneView& view, const PlaneMergingOptions& options) {
  const CameraPoses& poses = view.poses;
  if (a.kind() != b.kind() || a.cells().empty() || b.cells().empty()) return false;
  if (a.plane().n.dot(b.plane().n) < std::cos(options.angle_deg * M_PI / 180.0)) return false;
  const double area_a = a.area(), area_b = b.area();
  const PlaneTrack& small = area_a < area_b ? a : b;
  const PlaneTrack& large = area_a < area_b ? b : a;
  // Cheap: any cell of the smaller near the larger plane at all?
  const CellGrid& grid = small.cells();
  const Eigen::Vector3d middle = small.cellCentre({grid.x0() + grid.width() / 2, grid.y0() + grid.height() / 2});
  const double radius = 0.5 * small.cellSize() * std::hypot(grid.width(), grid.height());
  if (std::abs(large.plane().signedDistance(middle)) >
      options.distance + radius * std::sin(options.angle_deg * M_PI / 180.0)) {
    return false;
  }
  // A cupboard interrupts a wall and the wall goes on, the ceilings of two corridors meet where nobody looked. How far
  // apart two pieces of one plane may be follows from how well the smaller one determines its plane, not from a length.
  const double smaller = std::min(area_a, area_b);
  const double large_from = a.plane().n.z() > 0.5 ? kLargeFloor : kLargeWall;
  double gap = smaller >= large_from ? std::max(options.gap, options.gap_per_area * smaller) : options.gap;
  // The rest of a parapet behind a stair is small, but on its plane to the centimetre; furniture is seldom.
  double apart = options.distance_apart;
  const bool ceiling = a.kind() == PlaneKind::kHorizontal && a.plane().n.z() < 0;
  const double wall_from = smaller >= kPartition ? kPartition : large_from;
  const double larger_from = a.kind() == PlaneKind::kVertical ? wall_from : ceiling ? kLeastCeiling : kNoTable;
  if (smaller < large_from && a.kind() != PlaneKind::kGeneral && std::max(area_a, area_b) >= larger_from) {
    const double reach = ceiling ? options.gap_per_area * kLeastCeiling
                                 : std::min(options.gap_per_area * large_from, kSmallGap * std::sqrt(smaller));
    gap = std::max(options.gap, reach);
    apart *= 0.5;
  }
  // The underside of a duct or a beam, some of which nobody looked at.
  if (ceiling && smaller < large_from && gap <= options.gap && std::max(area_a, area_b) >= kLeastStrip) {
    gap = std::max(gap, lengthIfContinued(small, large));
    if (gap > options.gap) apart *= 0.5;
  }
  const double level_reach = options.gap_per_area * kLeastCeiling;
  if (a.kind() == PlaneKind::kHorizontal && gap < level_reach &&
      std::max(area_a, area_b) >= (ceiling ? kTopmostCeiling : kLowestFloor) &&
      boundsGap(small, large) <= level_reach && heightDifference(a, b) < 0.5 * options.distance_apart &&
      outermost(a, b, known)) {
    gap = level_reach;
    apart = 0.5 * options.distance_apart;
  }
  // That two surfaces lie in one plane by accident is the likelier the further one looks and the less is asked of them:
  // the same chance, with a gap as much wider as they agree better.
  const double between = boundsGap(small, large), widest = smaller >= large_from ? kCloser * gap : gap;
  const bool may_be_hidden = a.kind() != PlaneKind::kGeneral && gap < kHiddenGap && between <= kHiddenGap;
  if (between > widest && !may_be_hidden) return false;
  const Contact meeting = contact(small, large, options.gap);
  // The tenth of a degree by which a level surface may be tilted in the map is centimetres some metres further on; its
  // height is not.
  double off = meeting.worst_border;
  if (a.kind() == PlaneKind::kHorizontal && meeting.near == 0) {
    off = std::min(off, heightDifference(a, b));
  }
  // Whatever their sizes, pieces between which nothing is known to end may be one counter.
  const bool out_of_reach = between > widest || (meeting.near == 0 && gap <= options.gap);
  if (out_of_reach) {
    apart = 0.5 * options.distance_apart;
    if (!may_be_hidden || meeting.near > 0 || off > apart) return false;
    gap = kHiddenGap;
  }
  const double worst = std::max(meeting.worst_border, meeting.worst_meeting);
  if (worst > kNoisyDistance * options.distance) return false;
  // Of pieces far apart one plane in between serves both whatever they are.
  const bool beside = meeting.near == 0 && off > apart;
  const bool noise =
      (beside || worst > options.distance) && between <= std::sqrt(smaller) && noiseAllowsOne(a, b, poses);
  if (between > gap && off * between > apart * gap) return false;
  if ((beside || worst > options.distance) && !noise) return false;
  // A threshold, or the floor of a wet room.
  const bool floors = a.plane().n.z() > 0.5 && smaller >= kFloor;
  const double shared = double(meeting.shared) / std::max(1, meeting.cells);
  if (shownApart(small, large, poses, (floors ? 0.5 : 1.0) * options.max_rms)) return false;
  // A surface hides what is behind it, so two surfaces that face the same way do not show in the same place; with drift
  // one surface does. A rim of shared cells proves nothing, and a step may show both levels there.
  if (shared > options.overlap && meeting.separation < 0.5 * options.distance) return true;
  if (shared > 2 * options.overlap) return true;
  if (noise && !out_of_reach) return true;
  const double slack = options.max_rms * (ceiling ? kCeilingSlack : 1.0);
  return jointFitServes(surfaceMoments(a, poses), surfaceMoments(b, poses), large, slack) &&
         !(out_of_reach && gapMayBeOpen(small, large, view));
}

}  // namespace vip_slam
