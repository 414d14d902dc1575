// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/landmark_maker.h"

#include <cmath>

#include <Eigen/Dense>

#include "vip_slam_core/util/significance.h"

namespace vip_slam {

namespace {

constexpr double kGate = 12.0;  // px; a known track farther than this from its projection is not added

}  // namespace

int LandmarkMaker::process(KeyframeId id, Map* map, const std::function<bool(KeyframeId)>& allowed) {
  const KeyframePtr data = map->keyframe(id).data;
  const SE3 T_W_C = map->keyframe(id).T_W_C(), T_C_W = T_W_C.inverse();
  std::unordered_map<LandmarkId, std::vector<MapObservation>> still_waiting;
  int made = 0;
  for (std::uint32_t k = 0; k < data->frame.features.size(); ++k) {
    const Feature& f = data->frame.features[k];
    if (f.id == kNoLandmark) continue;
    const MapObservation here{id, k};
    const LandmarkId known = map->resolve(f.id);
    if (const MapLandmark* landmark = map->findLandmark(known)) {
      // The front end searches the map's landmarks also when T_map_odom is only a guess.
      if (allowed && !allowed(landmark->host())) continue;
      const Eigen::Vector3d p = T_C_W * landmark->p_W;
      const bool near = p.z() > 0.05 && (p.head<2>() / p.z() - f.xy.cast<double>()).norm() * focal_ < kGate;
      // With one view the landmark's position rests on one depth reading; then the track is more reliable than the
      // gate.
      if (near || landmark->observations.size() < 2) map->addObservation(known, here);
      continue;
    }
    if (known != f.id) continue;  // merged into a landmark that was removed
    // Waiting views of the track; one of them may have been matched with a known landmark meanwhile, which then owns
    // it.
    std::vector<MapObservation> views;
    LandmarkId recognised = map->keyframe(id).landmarks[k];
    const auto waited = waiting_.find(f.id);
    if (waited != waiting_.end())
      for (const MapObservation& o : waited->second) {
        if (!map->hasKeyframe(o.keyframe) || (allowed && !allowed(o.keyframe))) continue;
        const LandmarkId taken = map->keyframe(o.keyframe).landmarks[o.feature];
        if (taken != kNoLandmark)
          recognised = taken;
        else
          views.push_back(o);
      }
    if (recognised != kNoLandmark) {
      map->addObservation(recognised, here);
      continue;
    }
    if (f.depth > 0) {
      const Eigen::Vector3d p_C = Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0) * f.depth;
      map->addLandmark(f.id, T_W_C * p_C, here);
      for (const MapObservation& o : views) map->addObservation(f.id, o);
      ++made;
      continue;
    }
    views.push_back(here);
    Eigen::Vector3d p_W;
    if (views.size() >= 3 && triangulate(*map, views, &p_W)) {
      map->addLandmark(f.id, p_W, views.front());
      for (std::size_t v = 1; v < views.size(); ++v) map->addObservation(f.id, views[v]);
      ++made;
    } else {
      still_waiting[f.id] = std::move(views);
    }
  }
  waiting_ = std::move(still_waiting);
  return made;
}

bool LandmarkMaker::triangulate(const Map& map, const std::vector<MapObservation>& views, Eigen::Vector3d* p_W) const {
  // Mid-point of all rays: sum (I - r r^T)(p - c) = 0.
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const MapObservation& o : views) {
    const SE3 T_W_C = map.keyframe(o.keyframe).T_W_C();
    const Eigen::Vector2f& xy = map.feature(o).xy;
    const Eigen::Vector3d ray = (T_W_C.rotation() * Eigen::Vector3d(xy.x(), xy.y(), 1.0)).normalized();
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    A += P;
    b += P * T_W_C.t();
  }
  // Rays that are off by a pixel move the point along them by its distance over the root of A's least eigenvalue, in
  // pixels of the focal length: it must be in front of the cameras beyond noise.
  const double parallax = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues()(0);
  if (!(std::sqrt(parallax) * focal_ > kNoiseSigmas)) return false;
  *p_W = A.ldlt().solve(b);
  if (!p_W->allFinite()) return false;
  for (const MapObservation& o : views) {
    const Eigen::Vector3d p = map.keyframe(o.keyframe).T_W_C().inverse() * *p_W;
    if (p.z() < 0.1 || p.z() > 50) return false;
    const Eigen::Vector2d error = p.head<2>() / p.z() - map.feature(o).xy.cast<double>();
    if (error.norm() * focal_ > kNoiseSigmas) return false;
  }
  return true;
}

}  // namespace vip_slam
