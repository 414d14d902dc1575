// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/reobservation.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "vip_slam_backend/map/feature_grid.h"
#include "vip_slam_backend/map/views.h"

namespace vip_slam {
namespace {

constexpr double kMaxViewAngle = 1.0;  // radians between the ray then and now
constexpr double kMaxDistanceRatio = 2.0;

}  // namespace

std::vector<KeyframeId> Reobservation::neighbours(const Map& map, KeyframeId id,
                                                  const std::function<bool(KeyframeId)>& allowed) const {
  std::vector<KeyframeId> chosen;
  std::set<KeyframeId> taken{id};
  const std::size_t limit = static_cast<std::size_t>(options_.keyframes);
  for (const auto& c : map.covisible(id, 3)) {
    if (chosen.size() >= limit / 2) break;
    if (allowed && !allowed(c.first)) continue;
    chosen.push_back(c.first);
    taken.insert(c.first);
  }
  const auto other = [&](KeyframeId k) { return taken.count(k) == 0 && (!allowed || allowed(k)); };
  for (const KeyframeId view : viewsAlong(map, map.keyframe(id).T_W_C(), limit - chosen.size(), other))
    chosen.push_back(view);
  return chosen;
}

ReobservationResult Reobservation::process(KeyframeId id, Map* map,
                                           const std::function<bool(KeyframeId)>& allowed) const {
  ReobservationResult result;
  const MapKeyframe& kf = map->keyframe(id);
  const std::vector<Feature>& features = kf.features();
  if (options_.keyframes == 0 || features.empty()) return result;
  std::set<LandmarkId> candidates;
  for (const KeyframeId other : neighbours(*map, id, allowed))
    for (const LandmarkId landmark : map->keyframe(other).landmarks)
      if (landmark != kNoLandmark) candidates.insert(landmark);
  for (const LandmarkId own : kf.landmarks) candidates.erase(own);

  const FeatureGrid grid(features, camera_->width(), camera_->height(), options_.radius);
  const SE3 T_W_C = kf.T_W_C(), T_C_W = T_W_C.inverse();
  for (const LandmarkId landmark_id : candidates) {
    const MapLandmark* landmark = map->findLandmark(landmark_id);
    if (!landmark || landmark->observations.size() < 2) continue;
    const Eigen::Vector3d p_C = T_C_W * landmark->p_W;
    Eigen::Vector2d uv;
    if (p_C.z() < 0.1 || !camera_->project(p_C, &uv) || !camera_->inImage(uv, 2)) continue;
    const Eigen::Vector3d now = landmark->p_W - T_W_C.t();
    const Eigen::Vector3d then = landmark->p_W - map->keyframe(landmark->observations.back().keyframe).T_W_C().t();
    const double ratio = now.norm() / then.norm();
    if (now.dot(then) < std::cos(kMaxViewAngle) * now.norm() * then.norm()) continue;
    if (ratio > kMaxDistanceRatio || ratio < 1 / kMaxDistanceRatio) continue;
    ++result.candidates;
    int best = options_.max_hamming + 1, second = 256;
    std::uint32_t best_feature = 0;
    grid.around(uv, [&](std::uint32_t k) {
      const Feature& f = features[k];
      if (f.depth > 0 && std::abs(f.depth - p_C.z()) > 4 * f.depth_sigma + 0.03 * p_C.z()) return;
      const int distance = hammingDistance(f.descriptor, landmark->descriptor);
      if (distance < best) {
        // Two detections of one corner (within 2 px) do not compete in the ratio test.
        if (best <= options_.max_hamming && (features[best_feature].pixel - f.pixel).squaredNorm() > 4) second = best;
        best = distance;
        best_feature = k;
      } else if (distance < second && (features[best_feature].pixel - f.pixel).squaredNorm() > 4) {
        second = distance;
      }
    });
    map->landmark(landmark_id).visible++;
    if (best > options_.max_hamming || best > options_.ratio * second) continue;
    const LandmarkId own = kf.landmarks[best_feature];
    if (own == kNoLandmark) {
      if (map->addObservation(landmark_id, {id, best_feature})) {
        map->landmark(landmark_id).found++;
        ++result.found;
      }
      continue;
    }
    // The same point with two tracks: the older landmark id stays.
    const MapLandmark& other = map->landmark(own);
    const double pixels = (features[best_feature].pixel.cast<double>() - uv).norm();
    if (pixels * pixels > options_.merge_chi2) continue;
    if ((other.p_W - landmark->p_W).norm() > 0.02 * p_C.z() + 0.01) continue;
    const bool keep_other = other.observations.front().keyframe < landmark->observations.front().keyframe;
    if (map->mergeLandmarks(keep_other ? landmark_id : own, keep_other ? own : landmark_id)) ++result.merged;
  }
  return result;
}

}  // namespace vip_slam
