// SPDX-License-Identifier: BSD-3-Clause
// From a solved problem back to the map.
#include <algorithm>
#include <cmath>
#include <utility>

#include "landmark_views.h"
#include "plane_intersection.h"
#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {
namespace {

// Landmarks whose position is set; a compact hash set, since it is queried for every feature of the map.
class LandmarkSet {
 public:
  explicit LandmarkSet(std::size_t most) {
    std::size_t size = 16;
    while (size < 2 * most) size *= 2;
    slots_.assign(size, kNoLandmark);
  }
  void insert(LandmarkId id) { slots_[slotOf(id)] = id; }
  bool contains(LandmarkId id) const { return slots_[slotOf(id)] == id; }

 private:
  // Slot of the landmark, or the free slot for it.
  std::size_t slotOf(LandmarkId id) const {
    std::size_t slot = (static_cast<std::uint64_t>(id) * 0x9e3779b97f4a7c15ull) >> 32;
    for (slot &= slots_.size() - 1; slots_[slot] != id && slots_[slot] != kNoLandmark;)
      slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }
  std::vector<LandmarkId> slots_;
};

// Factor on the outlier limit for views refused by their plane. These are gated again at each build, with the estimate
// of that time, so only gross errors are removed for good.
constexpr double kGross = 10.0;

void storePlanePoints(const BuiltProblem& built, Map* map, LandmarkSet* done) {
  // Prefetch features a few landmarks ahead, since they are scattered over the keyframes.
  std::vector<const MapLandmark*> landmarks;
  landmarks.reserve(built.plane_points.size());
  for (const LandmarkId id : built.plane_points) {
    const MapLandmark* landmark = map->findLandmark(id);
    if (landmark && landmark->plane != 0 && map->hasPlane(landmark->plane)) landmarks.push_back(landmark);
  }
  PlaneIntersection intersection(*map);
  for (std::size_t k = 0; k < landmarks.size(); ++k) {
    if (k + kAhead < landmarks.size()) intersection.prefetch(*landmarks[k + kAhead]);
    const MapLandmark& landmark = *landmarks[k];
    done->insert(landmark.id);
    map->setPosition(landmark.id, intersection(landmark, map->planes().at(landmark.plane).estimate.plane));
  }
}

bool isInlier(const FrameGeometry& frame, const BaObservation& b, const Eigen::Vector3d& p_W, double gate_weight,
              double chi2) {
  Eigen::Vector2d r;
  const double weight = std::min(b.weight, gate_weight);
  return reprojectionResidual(frame, p_W, Eigen::Vector2d(b.x, b.y), weight, &r) && r.squaredNorm() <= chi2;
}

}  // namespace

std::vector<char> heldPlanes(const BaProblem& problem) {
  std::vector<char> held(problem.planes.size(), 0);
  for (const BaPointToPlane& f : problem.point_to_plane) held[f.plane] = 1;
  for (const BaPlaneSample& f : problem.plane_samples) held[f.plane] = 1;
  return held;
}

void storeProblem(const BuiltProblem& built, const ImuNoise& noise, Map* map) {
  const BaProblem& problem = built.problem;
  std::vector<std::pair<KeyframeId, SE3>> motion;
  for (std::size_t f = 0; f < built.frames.size(); ++f) {
    if (problem.frames[f].fixed || !map->hasKeyframe(built.frames[f])) continue;
    NavState state = problem.frames[f].state;
    // The camera's pose was adjusted; the extrinsics may have changed since the problem was built.
    const SE3& T_I_C = map->keyframe(built.frames[f]).T_I_C;
    if (T_I_C.matrix() != problem.frames[f].T_I_C.matrix()) {
      state.T_W_I = problem.frames[f].T_W_C() * T_I_C.inverse();
    }
    motion.emplace_back(built.frames[f], state.T_W_I * map->keyframe(built.frames[f]).state.T_W_I.inverse());
    map->setState(built.frames[f], state, noise);
  }
  const std::vector<char> held = heldPlanes(problem);
  for (std::size_t p = 0; p < built.planes.size(); ++p)
    if (held[p] && map->hasPlane(built.planes[p])) map->setPlaneParameters(built.planes[p], problem.planes[p].plane);
  for (std::size_t p = 0; p < built.surface_variances.size(); ++p)
    if (map->hasPlane(built.planes[p])) map->setSurfaceVariance(built.planes[p], built.surface_variances[p]);
  LandmarkSet done(built.points.size() + built.plane_points.size());
  for (std::size_t p = 0; p < built.points.size(); ++p) {
    if (done.contains(built.points[p])) continue;  // another track of the landmark
    done.insert(built.points[p]);
    if (map->hasLandmark(built.points[p])) map->setPosition(built.points[p], problem.points[p].p_W);
  }
  storePlanePoints(built, map, &done);
  for (const auto& moved : motion) {
    // Landmarks without factors move with their host keyframe.
    for (const LandmarkId id : map->keyframe(moved.first).landmarks) {
      if (id == kNoLandmark || done.contains(id) || map->landmark(id).host() != moved.first) continue;
      map->setPosition(id, moved.second * map->landmark(id).p_W);
    }
  }
}

std::vector<RefusedView> removeOutliers(const BuiltProblem& built, double chi2, Map* map) {
  const BaProblem& problem = built.problem;
  const std::vector<FrameGeometry> geometry = frameGeometry(problem);
  std::vector<RefusedView> removed;
  for (std::size_t p = 0; p < problem.points.size(); ++p) {
    const BaPoint& point = problem.points[p];
    for (int o = point.first; o < point.first + point.count && map->hasLandmark(built.points[p]); ++o) {
      const BaObservation& b = problem.observations[o];
      if (isInlier(geometry[b.frame], b, point.p_W, built.gate_weight, chi2)) continue;
      map->removeObservation(built.points[p], built.observations[o].keyframe);
      removed.push_back({built.points[p], built.observations[o].keyframe, b});
    }
  }
  for (const RefusedView& view : built.refused) {
    const MapLandmark* landmark = map->findLandmark(view.landmark);
    if (!landmark ||
        isInlier(geometry[view.observation.frame], view.observation, landmark->p_W, built.gate_weight, kGross * chi2))
      continue;
    map->removeObservation(view.landmark, view.keyframe);
    removed.push_back(view);
  }
  return removed;
}

std::vector<RefusedView> stillOutliers(const BuiltProblem& built, const std::vector<RefusedView>& outliers, double chi2,
                                       const Map& map) {
  const std::vector<FrameGeometry> geometry = frameGeometry(built.problem);
  std::vector<RefusedView> still;
  for (const RefusedView& outlier : outliers) {
    const MapLandmark* landmark = map.findLandmark(outlier.landmark);
    const BaObservation& b = outlier.observation;
    if (!landmark || !isInlier(geometry[b.frame], b, landmark->p_W, built.gate_weight, chi2)) still.push_back(outlier);
  }
  return still;
}

}  // namespace vip_slam
