#include "vip_slam_backend/relocalisation/relocaliser.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

bool samePose(const SE3& a, const SE3& b) {
  return (a.t() - b.t()).norm() < 0.3 && a.rotation().angularDistance(b.rotation()) < 0.2;
}

Relocalisation fromPlace(const PlaceVerification& place) {
  Relocalisation r;
  r.match = place.match;
  r.T_W_I = place.T_W_I;
  r.inliers = place.inliers;
  r.landmarks = place.landmarks;
  return r;
}

}  // namespace

SE3 alignOdometry(const SE3& T_map_I, const SE3& T_odom_I) {
  const double yaw = yawOf(T_map_I.rotation() * T_odom_I.rotation().conjugate());
  const Eigen::Quaterniond R(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return SE3(R, T_map_I.t() - R * T_odom_I.t());
}

std::optional<Relocalisation> Relocaliser::relocalise(const Map& map, const LoopCloser& places, const Keyframe& keyframe,
                                                      const std::function<bool(KeyframeId)>& allowed,
                                                      std::string* reason) const {
  const BowResult bow = places.describe(keyframe);
  const auto there = [&](KeyframeId id) { return map.hasKeyframe(id) && (!allowed || allowed(id)); };
  std::optional<Relocalisation> best;
  int rival = 0, tried = 0;
  std::string why = "nothing in the map looks like it";
  for (const DatabaseMatch& candidate : places.database().query(bow.bow, 4 * options_.candidates, there)) {
    if (tried >= options_.candidates) break;
    // Neighbours of a place that fits show the same; candidates are better spent elsewhere.
    if (best && map.keyframe(candidate.keyframe).T_W_C().t().isApprox(map.keyframe(best->match).T_W_C().t(), 1e-9)) continue;
    ++tried;
    const PlaceVerification place =
        places.verifier().verify(map, keyframe, keyframe.frame.state.T_W_I, bow, candidate.keyframe,
                                 places.database().bow(candidate.keyframe), allowed);
    if (!place.accepted || place.inliers < options_.min_inliers) {
      if (!best) why = place.reason;
      continue;
    }
    if (!best) {
      best = fromPlace(place);
    } else if (samePose(best->T_W_I, place.T_W_I)) {
      if (place.inliers > best->inliers) best = fromPlace(place);
    } else {
      rival = std::max(rival, std::min(place.inliers, best->inliers));
      if (place.inliers > best->inliers) best = fromPlace(place);
    }
  }
  if (best && rival > options_.ambiguity * best->inliers) {
    why = "two places of the map look like it (" + std::to_string(best->inliers) + " and " + std::to_string(rival) + " inliers)";
    best.reset();
  }
  if (!best && reason) *reason = why;
  return best;
}

std::optional<Relocalisation> Relocaliser::track(const Map& map, const LoopCloser& places, const Keyframe& keyframe,
                                                 const SE3& T_W_I) const {
  // The nearest keyframe that looks the same way.
  const SE3 T_W_C = T_W_I * keyframe.frame.T_I_C;
  const Eigen::Vector3d forward = T_W_C.rotation() * Eigen::Vector3d::UnitZ();
  KeyframeId nearest = 0;
  double best = 6.0;
  for (const auto& entry : map.keyframes()) {
    const SE3 other = entry.second.T_W_C();
    const double cosine = forward.dot(other.rotation() * Eigen::Vector3d::UnitZ());
    const double cost = (other.t() - T_W_C.t()).norm() + 4.0 * (1.0 - cosine);
    if (cosine > 0.5 && cost < best) {
      best = cost;
      nearest = entry.first;
    }
  }
  if (nearest == 0) return std::nullopt;
  const PlaceVerification place = places.verifier().track(map, keyframe, T_W_I, nearest, {});
  if (!place.accepted) return std::nullopt;
  return fromPlace(place);
}

}  // namespace vip_slam
