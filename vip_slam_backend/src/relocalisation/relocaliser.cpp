// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/relocalisation/relocaliser.h"

#include <cmath>

namespace vip_slam {
namespace {

Relocalisation fromPlace(const PlaceVerification& place) {
  Relocalisation r;
  r.match = place.match;
  r.T_W_I = place.T_W_I;
  r.inliers = place.inliers;
  r.landmarks = place.landmarks;
  return r;
}

}  // namespace

std::optional<Relocalisation> Relocaliser::relocalise(const Map& map, const LoopCloser& places,
                                                      const KeyframePtr& keyframe,
                                                      const std::function<bool(KeyframeId)>& allowed,
                                                      std::string* reason) {
  const PlaceVerification place =
      search_.add(map, places.database(), places.verifier(), keyframe, places.describe(*keyframe), allowed);
  if (reason) *reason = place.reason;
  if (!place.accepted) return std::nullopt;
  return fromPlace(place);
}

std::optional<Relocalisation> Relocaliser::track(const Map& map, const LoopCloser& places, const Keyframe& keyframe,
                                                 const SE3& T_W_I,
                                                 const std::function<bool(KeyframeId)>& allowed) const {
  // The nearest keyframe with a similar viewing direction.
  const SE3 T_W_C = T_W_I * keyframe.frame.T_I_C;
  const Eigen::Vector3d forward = T_W_C.rotation() * Eigen::Vector3d::UnitZ();
  KeyframeId nearest = 0;
  double best = 6.0;
  for (const auto& entry : map.keyframes()) {
    if (allowed && !allowed(entry.first)) continue;
    const SE3 other = entry.second.T_W_C();
    const double cosine = forward.dot(other.rotation() * Eigen::Vector3d::UnitZ());
    const double cost = (other.t() - T_W_C.t()).norm() + 4.0 * (1.0 - cosine);
    if (cosine > 0.5 && cost < best) {
      best = cost;
      nearest = entry.first;
    }
  }
  if (nearest == 0) return std::nullopt;
  const PlaceVerification place = places.verifier().track(map, keyframe, T_W_I, nearest, allowed);
  if (!place.accepted) return std::nullopt;
  return fromPlace(place);
}

}  // namespace vip_slam
