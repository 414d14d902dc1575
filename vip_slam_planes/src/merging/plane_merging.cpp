// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/merging/plane_merging.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "plane_extent.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/significance.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kNoisyDistance = 2.0;  // factor on the distance when noise explains it

PlaneMoments surfaceMoments(const PlaneTrack& track, const CameraPoses& poses) {
  PlaneMoments moments = track.samples(poses);
  if (moments.weight() > 0) return moments;
  // A plane of a loaded map has no observations: use its cells instead.
  track.cells().forEach([&](CellIndex c, int) { moments.add(track.cellCentre(c), 1.0); });
  return moments;
}

/// What a joint fit adds to the mean square of each, m^2; infinity when there is no fit.
std::array<double, 2> jointExcess(const PlaneMoments& a, const PlaneMoments& b, const PlaneTrack& track) {
  std::array<double, 2> excess;
  excess.fill(std::numeric_limits<double>::infinity());
  Plane joint, own_a, own_b;
  const auto fits = [&track](const PlaneMoments& m, Plane* plane) {
    return fitPlane(m, track.kind(), track.plane().n, plane);
  };
  if (!fits({a.M + b.M}, &joint) || !fits(a, &own_a) || !fits(b, &own_b)) return excess;
  excess = {a.meanSquare(joint) - a.meanSquare(own_a), b.meanSquare(joint) - b.meanSquare(own_b)};
  return excess;
}

/// What a joint fit adds to the RMS of the worse of both, m; infinity when there is no fit.
double jointMisfit(const PlaneMoments& a, const PlaneMoments& b, const PlaneTrack& track) {
  const auto [of_a, of_b] = jointExcess(a, b, track);
  return std::sqrt(std::max({0.0, of_a, of_b}));
}

/// Whether the noise of their depth points allows that both are one plane (significance of what a joint fit adds). From
/// afar the noise is centimetres and degrees, too much for a fixed limit. False for planes of a loaded map, whose noise
/// is not known.
bool noiseAllowsOne(const PlaneTrack& a, const PlaneTrack& b, const PlaneViews& views) {
  const PlaneMoments of_a = a.information(views), of_b = b.information(views);
  if (!(of_a.weight() > 0) || !(of_b.weight() > 0)) return false;
  const auto [excess_a, excess_b] = jointExcess(of_a, of_b, a);
  return of_a.weight() * excess_a + of_b.weight() * excess_b < kNoiseSigmas * kNoiseSigmas;
}

// Drift moves a keyframe as a whole, so surfaces that keyframes show at two depths are separate, even if views from
// afar, where a door's recess or a board on the wall is not visible, covered both. What a lens or a depth camera gets
// wrong in the same way each time does not average out: all views together are worth the best of them.
bool shownApart(const PlaneTrack& small, const PlaneTrack& large, const PlaneViews& views, double distance) {
  double sum = 0, information = 0, best = 0;  // of the distance between the two, in the keyframes that show both
  for (const auto& [keyframe, observation] : small.observations()) {
    const auto other = large.observations().find(keyframe);
    const auto pose = views.poses.find(keyframe);
    if (other == large.observations().end() || pose == views.poses.end()) continue;
    const Eigen::Vector3d n_C = pose->second.R().transpose() * large.plane().n;
    const PlaneMoments of_small = informationOf(observation, n_C, views),
                       of_large = informationOf(other->second, n_C, views);
    if (!(of_small.weight() > 0) || !(of_large.weight() > 0)) continue;
    const double weight = 1 / (1 / of_small.weight() + 1 / of_large.weight());
    sum += weight * n_C.dot(of_small.centroid() - of_large.centroid());
    information += weight;
    best = std::max(best, weight);
  }
  return best > 0 && std::abs(sum) / information > distance + kNoiseSigmas / std::sqrt(best);
}

/// How far off a single image shows the plane, one sigma, m: the median of its views; 0 without any.
double viewSigma(const PlaneTrack& track, const PlaneViews& views) {
  std::vector<double> sigmas;
  for (const auto& [keyframe, observation] : track.observations()) {
    const auto pose = views.poses.find(keyframe);
    if (pose == views.poses.end()) continue;
    const Eigen::Vector3d n_C = pose->second.R().transpose() * track.plane().n;
    const double weight = informationOf(observation, n_C, views).weight();
    if (weight > 0) sigmas.push_back(1 / std::sqrt(weight));
  }
  return sigmas.empty() ? 0 : upperMedian(std::move(sigmas));
}

}  // namespace

double jointMisfit(const PlaneTrack& a, const PlaneTrack& b, const CameraPoses& poses) {
  return jointMisfit(surfaceMoments(a, poses), surfaceMoments(b, poses), a.area() < b.area() ? b : a);
}

bool sameSurface(const PlaneTrack& a, const PlaneTrack& b, const SceneView& view, const PlaneMergingOptions& options) {
  const PlaneViews& views = view.views;
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
  const Contact meeting = contact(small, large, options.gap);
  const double worst = std::max(meeting.worst_border, meeting.worst_meeting), between = boundsGap(small, large);
  if (shownApart(small, large, views, options.max_rms)) return false;
  // A surface hides those behind it, so two surfaces that face the same way do not cover the same area, but one surface
  // does that images show at several distances, each piece from those that err to its side.
  const double shared = double(meeting.shared) / std::max(1, meeting.cells);
  const bool covered = shared > 2 * options.overlap;
  if (covered && meeting.separation < kNoiseSigmas * std::hypot(viewSigma(a, views), viewSigma(b, views))) return true;
  if (worst > kNoisyDistance * options.distance) return false;
  const auto noise = [&] { return between <= std::sqrt(small.area()) && noiseAllowsOne(a, b, views); };
  if (worst > options.distance && !noise()) return false;
  // So does one that is seen with drift. A shared rim of cells is no evidence, and at a step it may show both levels.
  if (covered || (shared > options.overlap && meeting.separation < 0.5 * options.distance)) return true;
  if (meeting.near == 0) {
    // A tilt error of a tenth of a degree extrapolates to centimetres some metres away, so compare heights of
    // horizontal surfaces instead. Steps in a floor and counters of two heights stay; walls and ceilings drift
    // further apart.
    double off = meeting.worst_border;
    if (a.kind() == PlaneKind::kHorizontal) off = std::min(off, heightDifference(a, b));
    const double drift = (a.plane().n.z() > 0.5 ? 1 : 2) * options.max_rms;
    if (off > std::min(drift, options.chance * small.area() / between) && !noise()) return false;
  }
  if (jointMisfit(surfaceMoments(a, views.poses), surfaceMoments(b, views.poses), large) > options.max_rms && !noise())
    return false;
  // Walls go on behind doors. Level surfaces at one height are seldom so by chance, as tables are, but these end.
  return meeting.near > 0 || a.kind() != PlaneKind::kHorizontal || !gapMayBeOpen(small, large, view);
}

}  // namespace vip_slam
