// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/relocalisation/relocaliser.h"

#include "vip_slam_backend/map/views.h"

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
  const auto nearest = viewsAlong(map, T_W_I * keyframe.frame.T_I_C, 1, allowed);
  if (nearest.empty()) return std::nullopt;
  const PlaceVerification place = places.verifier().track(map, keyframe, T_W_I, nearest.front(), allowed);
  if (!place.accepted) return std::nullopt;
  return fromPlace(place);
}

}  // namespace vip_slam
