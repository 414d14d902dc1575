#include "vip_slam_backend/loop/unique_place.h"

#include <algorithm>

namespace vip_slam {
namespace {

// Keyframes that look at the same scene as one that fits already: verifying them says nothing about other places.
bool sameView(const SE3& T_W_C_a, const SE3& T_W_C_b) {
  return (T_W_C_a.t() - T_W_C_b.t()).norm() < 1.0 && T_W_C_a.rotation().angularDistance(T_W_C_b.rotation()) < 0.5;
}

}  // namespace

bool samePlacePose(const SE3& a, const SE3& b) {
  return (a.t() - b.t()).norm() < 0.3 && a.rotation().angularDistance(b.rotation()) < 0.2;
}

bool PlaceAgreement::add(const TrackedFrame& frame, const SE3& T_W_I) {
  const SE3& T_odom_I = frame.state.T_W_I;
  const bool agrees = known_ && frame.epoch == epoch_ && samePlacePose(T_W_I_ * T_odom_I_.inverse() * T_odom_I, T_W_I);
  known_ = true;
  epoch_ = frame.epoch;
  T_odom_I_ = T_odom_I;
  T_W_I_ = T_W_I;
  return agrees;
}

std::optional<PlaceVerification> uniquePlace(const Map& map, const KeyframeDatabase& database,
                                             const PlaceVerifier& verifier, const RelocalisationOptions& options,
                                             const Keyframe& keyframe, const BowResult& bow,
                                             const std::function<bool(KeyframeId)>& allowed, std::string* reason) {
  const auto there = [&](KeyframeId id) { return map.hasKeyframe(id) && (!allowed || allowed(id)); };
  std::optional<PlaceVerification> best;
  int rival = 0, tried = 0;
  std::string why = "nothing in the map looks like it";
  for (const DatabaseMatch& candidate : database.query(bow.bow, 20 * static_cast<std::size_t>(options.candidates), there)) {
    if (tried >= options.candidates) break;
    if (best && sameView(map.keyframe(candidate.keyframe).T_W_C(), map.keyframe(best->match).T_W_C())) continue;
    ++tried;
    PlaceVerification place = verifier.verify(map, keyframe, keyframe.frame.state.T_W_I, bow, candidate.keyframe,
                                              database, allowed);
    if (!place.accepted || place.inliers < options.min_inliers) {
      if (!best) why = place.reason;
      continue;
    }
    const bool same = best && samePlacePose(best->T_W_I, place.T_W_I);
    if (best && !same) rival = std::max(rival, std::min(place.inliers, best->inliers));
    if (!best || place.inliers > best->inliers) best = std::move(place);
  }
  if (best && rival > options.ambiguity * best->inliers) {
    why = "two places of the map look like it (" + std::to_string(best->inliers) + " and " + std::to_string(rival) + " inliers)";
    best.reset();
  }
  if (!best && reason) *reason = why;
  return best;
}

}  // namespace vip_slam
