// SPDX-License-Identifier: BSD-3-Clause
// Correction of the map by an accepted place: plane check, pose-plane graph, evidence for the loop, landmark fusion.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/loop/loop_evidence.h"
#include "vip_slam_backend/loop/loop_fusion.h"
#include "vip_slam_backend/loop/scene_agreement.h"
#include "vip_slam_backend/map/views.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr int kFusedNeighbours = 8;

std::set<KeyframeId> withNeighbours(const Map& map, KeyframeId id, std::size_t most) {
  std::set<KeyframeId> result{id};
  for (KeyframeId k = map.keyframe(id).previous; k != 0 && result.size() < most; k = map.keyframe(k).previous)
    result.insert(k);
  return result;
}

std::set<KeyframeId> around(const Map& map, KeyframeId id, std::size_t most) {
  std::set<KeyframeId> result = withNeighbours(map, id, most);
  for (KeyframeId k = map.keyframe(id).next; k != 0 && result.size() < 2 * most; k = map.keyframe(k).next)
    result.insert(k);
  return result;
}

// Metres over which the places of some keyframes lie.
double extentOf(const Map& map, const std::set<KeyframeId>& part) {
  Eigen::AlignedBox3d box;
  for (const KeyframeId id : part) box.extend(map.keyframe(id).state.T_W_I.t());
  return box.diagonal().norm() + 2 * kSight;
}

}  // namespace

LoopEvent LoopCloser::correct(Map& map, KeyframeId query, const PlaceVerification& place) {
  const MapKeyframe& kf = map.keyframe(query);
  LoopEvent event;
  event.query = query;
  event.match = place.match;
  event.t = kf.data->frame.t;
  event.inliers = place.inliers;
  event.reason = place.reason;
  if (place.match == 0) return event;
  const SE3 T_match_query = map.keyframe(place.match).state.T_W_I.inverse() * place.T_W_I;
  event.T_match_query = T_match_query;
  if (!place.accepted) return event;
  // Rotates about the keyframe, not about the map's origin: far from there any tilt would shift the planes.
  const SE3 correction = alignLevelled(place.T_W_I, kf.state.T_W_I);

  // Planes of the two ends must coincide or be distinct, but not be shifted copies. The newest keyframe's planes arrive
  // later, so use those of the keyframes before it.
  const PlaneAgreement planes =
      comparePlanes(map, withNeighbours(map, query, 5), around(map, place.match, 4), correction);
  if (planes.contradictions > static_cast<int>(planes.same.size())) {
    event.reason = formatted("%d planes contradict, %zu agree", planes.contradictions, planes.same.size());
    return event;
  }

  // When the loop joins two parts of the map, one is moved to the other as a whole, without odometry edges between
  // them. The reference part stays, whichever part the query belongs to, since the other's place was a guess.
  std::set<KeyframeId> part = connectedKeyframes(map, query, loops_);
  const bool tied = part.count(place.match) != 0;
  // The share of cells tells nothing then, and the term of the pose alone would accept a chance pose near the expected.
  if (tied && place.coverage.cells == 0) {
    event.reason = formatted("%d inliers, but from there the map shows nothing of the image", place.inliers);
    return event;
  }
  SE3 move = correction;
  if (!tied && referencePart(map, loops_).count(query)) {
    part = connectedKeyframes(map, place.match, loops_);
    move = correction.inverse();
  }
  std::map<KeyframeId, SE3> start;
  for (const KeyframeId id : part)
    start[id] = tied ? map.keyframe(id).state.T_W_I : move * map.keyframe(id).state.T_W_I;

  PosePlaneGraph graph = buildPosePlaneGraph(map, loops_, tied ? planes.same : decltype(planes.same)(),
                                             {query, place.match}, options_.min_seconds, options_.graph);
  if (!tied) {
    for (const auto& pose : start) graph.addPose(pose.first, pose.second);
    for (const auto& plane : map.planes()) {
      const bool moves = std::any_of(part.begin(), part.end(),
                                     [&](KeyframeId id) { return map.keyframe(id).planes.count(plane.first) != 0; });
      if (moves) graph.addPlane(plane.first, transformPlane(move, plane.second.estimate.plane));
    }
  }
  const Matrix6d loop_information = loopSqrtInformation(place.information, map.keyframe(place.match).state.T_W_I,
                                                        place.T_W_I, kf.T_I_C, options_.graph);
  std::optional<Eigen::Matrix3d> known;
  if (tied) known = graph.positionCovariance(place.match, query);
  graph.addEdge(RelativePoseEdge{place.match, query, T_match_query, loop_information});
  const PosePlaneSolution solution = graph.solve(options_.graph.max_iterations);
  if (!solution.usable) {
    event.reason = "the pose-plane graph has no solution";
    return event;
  }
  if (known) {
    const Matrix6d loop_covariance = (loop_information.transpose() * loop_information).inverse();
    const double pose =
        poseEvidence(solution.chi2, *known + loop_covariance.bottomRightCorner<3, 3>(), extentOf(map, part));
    const double matches = matchEvidence(place.coverage);
    if (matches + pose < options_.graph.min_log_odds) {
      event.reason = formatted(
          "log odds %.1f, needs %.1f: %.1f for %d inliers in %d of %d cells of the image, %.1f for the pose (chi2 "
          "%.1f, moves %.3f m)",
          matches + pose, options_.graph.min_log_odds, matches, place.inliers, place.coverage.explained_cells,
          place.coverage.cells, pose, solution.chi2, correction.t().norm());
      return event;
    }
  }
  map.moveKeyframes(solution.T_W_I);
  // Planes that no keyframe observes had no edges in the graph: they keep their parameters.
  std::set<PlaneId> observed;
  for (const auto& entry : map.keyframes())
    for (const auto& seen : entry.second.planes) observed.insert(seen.first);
  for (const auto& same : planes.same) observed.insert(same.second);
  for (const auto& plane : solution.planes)
    if (observed.count(plane.first)) map.setPlaneParameters(plane.first, plane.second);
  for (const auto& same : planes.same)
    if (tied) map.setPlaneParameters(same.first, solution.planes.at(same.second));
  map.keyframe(query).loop_keyframe = map.keyframe(place.match).loop_keyframe = true;
  loops_.emplace_back(query, place.match);
  recent_places_.clear();
  event.reason = formatted("%s, chi2 %.1f, %zu planes agree", place.reason.c_str(), solution.chi2, planes.same.size());
  fuse(map, query, place);
  event.accepted = true;
  return event;
}

void LoopCloser::fuse(Map& map, KeyframeId query, const PlaceVerification& place) {
  fuseLandmarks(map, query, place.landmarks);
  const KeyframePtr& data = map.keyframe(query).data;
  const auto old = [&](KeyframeId id) { return isOld(map, id, *data); };
  // The keyframes just before the query saw the place as well.
  int left = kFusedNeighbours;
  for (KeyframeId id = map.keyframe(query).previous; id != 0 && left > 0; id = map.keyframe(id).previous, --left) {
    if (id == place.match) break;
    const MapKeyframe& kf = map.keyframe(id);
    const PlaceVerification neighbour = verifier_.track(map, *kf.data, kf.state.T_W_I, place.match, old);
    if (neighbour.inliers >= 12) fuseLandmarks(map, id, neighbour.landmarks);
  }
}

}  // namespace vip_slam
