// SPDX-License-Identifier: BSD-3-Clause
#include "plane_intersection.h"

#include <cmath>

namespace vip_slam {

namespace {

// Rays that miss the mean by more than this, in normalised coordinates (about five pixels), are down-weighted, so that
// a wrong view does not bias the landmark. A fifth of it also down-weights views that differ by remaining pose errors,
// which made sequence 02 less accurate by a quarter.
constexpr double kAgree = 1e-2;
constexpr int kRounds = 5;

}  // namespace

PlaneIntersection::PlaneIntersection(const Map& map)
    : map_(map), lowest_(map.empty() ? 0 : map.keyframes().begin()->first) {
  camera_of_.assign(map.empty() ? 0 : map.newestKeyframe() - lowest_ + 1, -1);
}

const PlaneIntersection::Camera& PlaneIntersection::camera(KeyframeId id) {
  int& place = camera_of_[id - lowest_];
  if (place < 0) {
    place = static_cast<int>(cameras_.size());
    const MapKeyframe& kf = map_.keyframe(id);
    const SE3 T_W_C = kf.T_W_C();
    cameras_.push_back({T_W_C.R(), T_W_C.t(), kf.features().data()});
  }
  return cameras_[place];
}

Eigen::Vector3d PlaneIntersection::operator()(const MapLandmark& landmark, const Plane& plane) {
  hits_.clear();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const MapObservation& o : landmark.observations) {
    const Camera& c = camera(o.keyframe);
    const Eigen::Vector2f& xy = c.features[o.feature].xy;
    const Eigen::Vector3d ray = c.R_W_C * Eigen::Vector3d(xy.x(), xy.y(), 1.0);
    const double incidence = plane.n.dot(ray);
    const double z = -plane.signedDistance(c.t_W_C) / incidence;
    const double cosine = std::abs(incidence) / ray.norm();
    if (!(z > 0.05) || cosine < 0.1) continue;
    // The error of an intersection grows with the distance and the slant of the ray.
    const double weight = cosine * cosine / (z * z);
    hits_.push_back({c.t_W_C + z * ray, weight});
    sum += weight * hits_.back().p_W;
    weights += weight;
  }
  if (weights == 0) return plane.project(landmark.p_W);
  Eigen::Vector3d mean = sum / weights;
  for (int round = 0; round < kRounds; ++round) {
    sum.setZero();
    weights = 0;
    bool all_agree = true;
    for (const Hit& hit : hits_) {
      const double apart2 = hit.weight * (hit.p_W - mean).squaredNorm();
      const bool agrees = apart2 <= kAgree * kAgree;
      all_agree = all_agree && agrees;
      const double weight = agrees ? hit.weight : hit.weight * kAgree * kAgree / apart2;
      sum += weight * hit.p_W;
      weights += weight;
    }
    if (all_agree) break;
    mean = sum / weights;
  }
  return mean;
}

void PlaneIntersection::prefetch(const MapLandmark& landmark) {
  for (const MapObservation& o : landmark.observations) __builtin_prefetch(&camera(o.keyframe).features[o.feature].xy);
}

}  // namespace vip_slam
