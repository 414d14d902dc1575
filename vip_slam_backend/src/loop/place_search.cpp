// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_search.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/map/views.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr std::size_t kNewGuesses = 4, kKeptGuesses = 4, kRivalGuesses = 8;
constexpr int kFewLandmarks = 5;  // fewer missing landmarks may be occluded or not visible from here

// Whether two keyframes look at the same scene, so that one of them is enough as a candidate.
bool sameView(const SE3& T_W_C_a, const SE3& T_W_C_b) {
  return (T_W_C_a.t() - T_W_C_b.t()).norm() < 1.0 && T_W_C_a.rotation().angularDistance(T_W_C_b.rotation()) < 0.5;
}

}  // namespace

void PlaceSearch::clear() {
  keyframes_.clear();
  bows_.clear();
  guesses_.clear();
  believed_.reset();
}

std::vector<KeyframeId> PlaceSearch::viewsLikeNewest(const Scene& scene) const {
  const auto there = [&](KeyframeId id) { return scene.map.hasKeyframe(id) && (!scene.allowed || scene.allowed(id)); };
  const std::size_t most = static_cast<std::size_t>(options_.candidates + options_.rivals);
  std::vector<KeyframeId> views;
  std::vector<std::pair<SE3, std::uint32_t>> seen;  // T_W_C, part
  for (const DatabaseMatch& candidate : scene.database.query(bows_.back().bow, 20 * most, there)) {
    if (views.size() >= most) break;
    const SE3 view = scene.map.keyframe(candidate.keyframe).T_W_C();
    const std::uint32_t part = scene.partOf(candidate.keyframe);
    const auto same = [&](const auto& other) { return other.second == part && sameView(other.first, view); };
    if (std::any_of(seen.begin(), seen.end(), same)) continue;
    views.push_back(candidate.keyframe);
    seen.emplace_back(view, part);
  }
  return views;
}

std::vector<PlaceSearch::Place> PlaceSearch::guesses(const Scene& scene, std::size_t first, std::size_t last,
                                                     std::size_t most) const {
  const Keyframe& newest = *keyframes_.back();
  const SE3 T_odom_B = newest.frame.state.T_W_I * newest.frame.T_I_C;
  const CameraRig rig = rigOf(keyframes_);
  std::vector<std::pair<std::size_t, Place>> found;
  for (std::size_t v = first; v < std::min(last, scene.views.size()); ++v) {
    std::vector<PlaceMatch> matches;
    for (std::uint32_t c = 0; c < keyframes_.size(); ++c)
      for (PlaceMatch m :
           scene.verifier.match(scene.map, *keyframes_[c], bows_[c], scene.views[v], scene.database, scene.allowed)) {
        m.camera = c;
        matches.push_back(m);
      }
    PlacePoseOptions pose_options = scene.verifier.poseOptions();
    pose_options.iterations = options_.ransac_iterations;
    pose_options.seed = newest.id * 1000003ull + scene.views[v];
    const PlacePose pose = ransacPlacePose(matches, rig, T_odom_B.rotation(), pose_options);
    if (static_cast<int>(pose.inliers.size()) < options_.min_seed_inliers) continue;
    const Place place{pose.T_W_B * T_odom_B.inverse(), scene.partOf(scene.views[v])};
    const auto same = std::find_if(found.begin(), found.end(), [&](const auto& f) {
      return f.second.part == place.part && samePlace(f.second.T_W_odom * T_odom_B, pose.T_W_B);
    });
    if (same == found.end())
      found.emplace_back(pose.inliers.size(), place);
    else if (same->first < pose.inliers.size())
      *same = {pose.inliers.size(), place};
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (found.size() > most) found.resize(most);
  std::vector<Place> result;
  for (const auto& f : found) result.push_back(f.second);
  return result;
}

void PlaceSearch::weigh(const Scene& scene, const std::vector<Place>& places) {
  const SE3 T_odom_B = keyframes_.back()->frame.state.T_W_I * keyframes_.back()->frame.T_I_C;
  for (const auto& [T_W_odom, part] : places) {
    const auto at = [part = part](const SE3& T_W_C) {
      return [part, T_W_C](const Guess& g) { return g.place.part == part && samePlace(g.support.T_W_C, T_W_C); };
    };
    if (std::any_of(guesses_.begin(), guesses_.end(), at(T_W_odom * T_odom_B))) continue;
    const auto in_part = [&scene, part = part](KeyframeId id) {
      return scene.partOf(id) == part && (!scene.allowed || scene.allowed(id));
    };
    PlaceSupport support = placeSupport(scene.map, keyframes_, T_W_odom, scene.verifier, in_part);
    if (!support.found || support.points < options_.min_seed_inliers) continue;
    // Hypotheses that the refinement moved to the same pose are one place.
    const auto same = std::find_if(guesses_.begin(), guesses_.end(), at(support.T_W_C));
    const Place place{support.T_W_C * T_odom_B.inverse(), part};
    if (same == guesses_.end())
      guesses_.push_back({place, std::move(support)});
    else if (same->support.evidence() < support.evidence())
      *same = {place, std::move(support)};
  }
  std::stable_sort(guesses_.begin(), guesses_.end(),
                   [](const Guess& a, const Guess& b) { return a.support.evidence() > b.support.evidence(); });
}

PlaceVerification PlaceSearch::add(const Map& map, const KeyframeDatabase& database, const PlaceVerifier& verifier,
                                   const KeyframePtr& keyframe, const BowResult& bow,
                                   const std::function<bool(KeyframeId)>& allowed,
                                   const std::function<std::uint32_t(KeyframeId)>& part_of) {
  if (!keyframes_.empty() && keyframes_.back()->frame.epoch != keyframe->frame.epoch) clear();
  keyframes_.push_back(keyframe);
  bows_.push_back(bow);
  while (keyframes_.size() > static_cast<std::size_t>(options_.keyframes) ||
         keyframe->frame.t - keyframes_.front()->frame.t > options_.seconds) {
    keyframes_.erase(keyframes_.begin());
    bows_.erase(bows_.begin());
  }

  Scene scene{map, database, verifier, allowed, part_of, {}};
  scene.views = viewsLikeNewest(scene);
  const std::size_t candidates = static_cast<std::size_t>(options_.candidates);
  std::vector<Place> places;
  for (const Guess& guess : guesses_) places.push_back(guess.place);
  const std::vector<Place> fresh = guesses(scene, 0, candidates, kNewGuesses);
  places.insert(places.end(), fresh.begin(), fresh.end());
  guesses_.clear();
  weigh(scene, places);
  PlaceVerification result = judge(scene);
  if (result.accepted) {
    // Before it is accepted also check less similar views for a rival place: corridors repeat themselves.
    weigh(scene, guesses(scene, candidates, scene.views.size(), kRivalGuesses));
    result = judge(scene);
  }
  if (result.accepted) {
    // A chance resemblance disappears with the view, a true place is found again by the next keyframe.
    const Place& now = guesses_.front().place;
    const SE3 T_odom_B = keyframe->frame.state.T_W_I * keyframe->frame.T_I_C;
    const bool again =
        believed_ && believed_->part == now.part && samePlace(believed_->T_W_odom * T_odom_B, now.T_W_odom * T_odom_B);
    believed_ = now;
    // Confirmation by the next keyframe outweighs one doubt, not two: a similar wall stays in view as well.
    const std::vector<std::string> left = doubts();
    if (left.size() > 1) believed_.reset();
    if (left.size() > (again ? 1 : 0)) {
      result.accepted = false;
      for (const std::string& doubt : left) result.reason += "; " + doubt;
      if (left.size() == 1) result.reason += ", waits for another keyframe that comes to the same place";
    }
  } else {
    believed_.reset();
  }
  if (guesses_.size() > kKeptGuesses) guesses_.resize(kKeptGuesses);
  return result;
}

PlaceVerification PlaceSearch::judge(const Scene& scene) const {
  PlaceVerification result;
  result.reason = "nothing in the map looks like it";
  if (guesses_.empty()) return result;
  const PlaceSupport& best = guesses_.front().support;
  result.match = best.match;
  result.T_W_I = best.T_W_C * keyframes_.back()->frame.T_I_C.inverse();
  result.information = best.information;
  result.inliers = best.points;
  result.landmarks = best.landmarks;
  if (best.depth.compared >= 100) result.depth_agreement = best.depth.agreement();

  const PlaceVerificationOptions& limits = scene.verifier.options();
  int features = 0;
  for (const KeyframePtr& keyframe : keyframes_)
    for (const Feature& f : keyframe->frame.features) features += f.depth > 0;
  const double sigma = std::sqrt(Matrix6d(best.information.inverse()).bottomRightCorner<3, 3>().diagonal().maxCoeff());
  const double evidence = best.evidence(), covered = features ? static_cast<double>(best.covered) / features : 0;
  result.reason =
      formatted("%d points, %d of %d landmarks and %.2f of the image in sight of the map, depth agreement %.2f",
                best.points, best.refound, best.established, best.explainedCells(), result.depth_agreement);
  if (best.match == 0) {
    result.reason += "; the map has no view along the newest keyframe";
  } else if (best.points < options_.min_points) {
    result.reason += formatted("; needs %d points", options_.min_points);
  } else if (evidence < options_.min_evidence) {
    result.reason += formatted("; evidence %.0f, needs %.0f", evidence, options_.min_evidence);
  } else if (covered < options_.min_covered) {
    result.reason += formatted("; the map covers %.2f of the features, needs %.2f", covered, options_.min_covered);
  } else if (!(sigma <= limits.max_sigma_position)) {
    result.reason += formatted("; position is known to %.3f m only", sigma);
  } else if (best.depth.compared >= 100 && best.depth.agreement() < limits.min_depth_agreement) {
    result.reason += formatted("; needs %.2f agreement", limits.min_depth_agreement);
  } else if (best.depth.compared >= 100 && best.depth.seeThrough() > limits.max_see_through) {
    result.reason += formatted("; %.2f of the surfaces are seen through", best.depth.seeThrough());
  } else if (guesses_.size() > 1 && guesses_[1].support.evidence() > options_.ambiguity * evidence) {
    result.reason += formatted("; evidence %.0f, for another place %.0f", evidence, guesses_[1].support.evidence());
  } else {
    result.accepted = true;
  }
  return result;
}

std::vector<std::string> PlaceSearch::doubts() const {
  const PlaceSupport& best = guesses_.front().support;
  std::vector<std::string> doubts;
  // When another place has the same posters on a wall of another shape, the agreement in shape proves little: the place
  // that is really seen may have the same shape and not be in the map.
  int alike = 0;
  for (std::size_t g = 1; g < guesses_.size(); ++g) alike = std::max(alike, guesses_[g].support.points);
  if (alike > options_.resemblance * best.points)
    doubts.push_back(formatted("another place has %d of such points", alike));
  if (best.points < options_.sure_points || best.evidence() < options_.sure_evidence)
    doubts.push_back(formatted("evidence %.0f of %d points is not sure", best.evidence(), best.points));
  // On a bare wall that resembles another one points fit by chance, but the established landmarks are missing there.
  if (best.refound == 0 && best.established >= kFewLandmarks)
    doubts.push_back(formatted("none of %d landmarks that should be in sight is", best.established));
  return doubts;
}

}  // namespace vip_slam
