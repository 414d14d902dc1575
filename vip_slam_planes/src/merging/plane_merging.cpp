#include "vip_slam_planes/merging/plane_merging.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plane_extent.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

// Smaller walls and ceilings may be furniture. Upward-facing planes are kept separate until they are as large as a
// floor, since two tables are two planes.
constexpr double kLargeFloor = 4.0;  // m^2
constexpr double kFloor = 1.0;       // m^2; a smaller upward-facing plane may be an object on it
constexpr double kPartition = 0.5;   // m^2; free-standing walls and doors whose middle is hidden
// Between the pieces of so large a wall lies a way on which poses drift, while no two such walls are nearly one plane.
constexpr double kSideOfRoom = 4.0;  // m^2
constexpr double kDrifted = 2.0;     // factor on the distance
constexpr double kNoTable = 20.0;    // m^2; a piece at the height of so large a surface belongs to it
constexpr double kMinCeiling = 4.0;  // m^2; larger than undersides of furniture, which are not level with a ceiling
// Smaller ones suffice for a ceiling at which walls end with nothing above, and for a floor with nothing below.
constexpr double kTopmostCeiling = 1.0, kLowestFloor = 0.5;  // m^2
// Ceilings are seen at flat angles and from afar, so their fits are worse; no two wide ones are so close in height.
constexpr double kCeilingSlack = 1.5;   // factor on max_rms
constexpr double kMinStrip = 1.0;       // m^2; boards of shelves are smaller
constexpr double kSmallGap = 4.0;       // largest gap of a small piece of a wall, in its own widths
constexpr double kHiddenGap = 4.0;      // m, reach of depth indoors: a surface may continue so far where it is not seen
constexpr double kNoise = 11.3;         // 99 % quantile of the chi-square with three degrees of freedom
constexpr double kNoisyDistance = 2.0;  // factor on the distance when noise explains it
constexpr double kCloser = 4.0;         // largest factor on the gap, when the pieces agree as many times better

PlaneMoments surfaceMoments(const PlaneTrack& track, const CameraPoses& poses) {
  PlaneMoments moments = track.moments(poses);
  if (moments.weight() > 0) return moments;
  // A plane of a loaded map has no observations: use its cells instead.
  track.cells().forEach([&](CellIndex c, int) { moments.add(track.cellCentre(c), 1.0); });
  return moments;
}

/// What a joint fit adds to the RMS of the worse of both, m; infinity when there is no fit.
double jointMisfit(const PlaneMoments& a, const PlaneMoments& b, const PlaneTrack& track) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const PlaneMoments both{a.M + b.M};
  Plane joint, own;
  if (!fitPlane(both, track.kind(), track.plane().n, &joint)) return kNone;
  double worst = 0;
  for (const PlaneMoments* m : {&a, &b}) {
    if (!fitPlane(*m, track.kind(), track.plane().n, &own)) return kNone;
    worst = std::max(worst, m->meanSquare(joint) - m->meanSquare(own));
  }
  return std::sqrt(worst);
}

/// Whether the noise of their depth points allows that both are one plane (chi-square test). From afar the noise is
/// centimetres and degrees, too much for a fixed limit. False for planes of a loaded map, whose noise is not known.
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

// Drift moves a keyframe as a whole, so surfaces that one keyframe shows at two depths are separate, even if views from
// afar, where a door's recess or a board on the wall is not visible, covered both.
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

bool facesDown(const PlaneTrack& track) { return track.kind() == PlaneKind::kHorizontal && track.plane().n.z() < 0; }

/// Area from which a plane is more than furniture, m^2.
double largeFrom(const PlaneTrack& track) { return track.plane().n.z() > 0.5 ? kLargeFloor : kLargeWall; }

/// How far apart two pieces of one plane may be, m, and how well they then have to agree, m.
struct Allowance {
  double gap, apart;
};

// A wall may continue behind a cupboard, and ceilings of two corridors may meet where they were not seen. The gap
// allowed between two pieces depends on the smaller one's area, which determines its plane, not on a fixed length.
Allowance allowanceFor(const PlaneTrack& small, const PlaneTrack& large, const std::vector<const PlaneTrack*>& known,
                       const PlaneMergingOptions& options) {
  const PlaneKind kind = small.kind();
  const double smaller = small.area(), larger = large.area(), large_from = largeFrom(small);
  const bool ceiling = facesDown(small);
  Allowance allowed{options.gap, options.distance_apart};
  if (smaller >= large_from) allowed.gap = std::max(options.gap, options.gap_per_area * smaller);
  if (kind == PlaneKind::kVertical && smaller >= kSideOfRoom) allowed.apart *= kDrifted;
  // The rest of a parapet behind a stair is small, but within a centimetre of its plane, as furniture seldom is.
  const double wall_from = smaller >= kPartition ? kPartition : large_from;
  const double larger_from = kind == PlaneKind::kVertical ? wall_from : ceiling ? kMinCeiling : kNoTable;
  if (smaller < large_from && kind != PlaneKind::kGeneral && larger >= larger_from) {
    const double reach = ceiling ? options.gap_per_area * kMinCeiling
                                 : std::min(options.gap_per_area * large_from, kSmallGap * std::sqrt(smaller));
    allowed = {std::max(options.gap, reach), 0.5 * options.distance_apart};
  }
  // The underside of a duct or a beam, parts of which were not seen.
  if (ceiling && smaller < large_from && allowed.gap <= options.gap && larger >= kMinStrip) {
    allowed.gap = std::max(allowed.gap, lengthIfContinued(small, large));
    if (allowed.gap > options.gap) allowed.apart *= 0.5;
  }
  const double level_reach = options.gap_per_area * kMinCeiling;
  if (kind == PlaneKind::kHorizontal && allowed.gap < level_reach &&
      larger >= (ceiling ? kTopmostCeiling : kLowestFloor) && boundsGap(small, large) <= level_reach &&
      heightDifference(small, large) < 0.5 * options.distance_apart && outermost(small, large, known)) {
    allowed = {level_reach, 0.5 * options.distance_apart};
  }
  return allowed;
}

}  // namespace

double jointMisfit(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses) {
  return jointMisfit(surfaceMoments(a, poses), surfaceMoments(b, poses), a.area() < b.area() ? b : a);
}

bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const std::vector<const PlaneTrack*>& known,
                 const SceneView& view, const PlaneMergingOptions& options) {
  const CameraPoses& poses = view.poses;
  if (a.kind() != b.kind() || a.cells().empty() || b.cells().empty()) return false;
  if (a.plane().n.dot(b.plane().n) < std::cos(options.angle_deg * kDegree)) return false;
  const bool a_is_small = a.area() < b.area();
  const PlaneTrack& small = a_is_small ? a : b;
  const PlaneTrack& large = a_is_small ? b : a;
  // Cheap pre-test: whether any cell of the smaller can be near the larger plane.
  const CellGrid& grid = small.cells();
  const Eigen::Vector3d middle = small.cellCentre({grid.x0() + grid.width() / 2, grid.y0() + grid.height() / 2});
  const double radius = 0.5 * small.cellSize() * std::hypot(grid.width(), grid.height());
  if (std::abs(large.plane().signedDistance(middle)) >
      options.distance + radius * std::sin(options.angle_deg * kDegree)) {
    return false;
  }
  const double smaller = small.area();
  const bool ceiling = facesDown(a);
  const double large_from = largeFrom(a);
  Allowance allowed = allowanceFor(small, large, known, options);
  double &gap = allowed.gap, &apart = allowed.apart;
  // The probability that two surfaces are coplanar by accident grows with the gap and with the tolerance: for the same
  // probability the gap may be wider in proportion as they agree better.
  const double between = boundsGap(small, large), widest = smaller >= large_from ? kCloser * gap : gap;
  const bool may_be_hidden = a.kind() != PlaneKind::kGeneral && gap < kHiddenGap && between <= kHiddenGap;
  if (between > widest && !may_be_hidden) return false;
  const Contact meeting = contact(small, large, options.gap);
  // A tilt error of a tenth of a degree extrapolates to centimetres some metres away, so compare heights of horizontal
  // surfaces instead.
  double off = meeting.worst_border;
  if (a.kind() == PlaneKind::kHorizontal && meeting.near == 0) {
    off = std::min(off, heightDifference(a, b));
  }
  // Regardless of their sizes, pieces without a visible end in between may be one counter.
  const bool out_of_reach = between > widest || (meeting.near == 0 && gap <= options.gap);
  if (out_of_reach) {
    apart = 0.5 * options.distance_apart;
    if (!may_be_hidden || meeting.near > 0 || off > apart) return false;
    gap = kHiddenGap;
  }
  const double worst = std::max(meeting.worst_border, meeting.worst_meeting);
  if (worst > kNoisyDistance * options.distance) return false;
  // For distant pieces one plane fits both whatever they are, so they must agree better.
  const bool beside = meeting.near == 0 && off > apart;
  const bool noise =
      (beside || worst > options.distance) && between <= std::sqrt(smaller) && noiseAllowsOne(a, b, poses);
  if (between > gap && off * between > apart * gap) return false;
  if ((beside || worst > options.distance) && !noise) return false;
  // Floors may differ by a threshold, as that of a bathroom: stricter limit.
  const bool floors = a.plane().n.z() > 0.5 && smaller >= kFloor;
  const double shared = double(meeting.shared) / std::max(1, meeting.cells);
  if (shownApart(small, large, poses, (floors ? 0.5 : 1.0) * options.max_rms)) return false;
  // A surface hides those behind it, so two surfaces that face the same way do not cover the same area, but one surface
  // seen with drift does. A shared rim of cells is no evidence, and at a step it may show both levels.
  if (shared > options.overlap && meeting.separation < 0.5 * options.distance) return true;
  if (shared > 2 * options.overlap) return true;
  if (noise && !out_of_reach) return true;
  const double slack = options.max_rms * (ceiling ? kCeilingSlack : 1.0);
  return jointMisfit(surfaceMoments(a, poses), surfaceMoments(b, poses), large) <= slack &&
         !(out_of_reach && gapMayBeOpen(small, large, view));
}

}  // namespace vip_slam
