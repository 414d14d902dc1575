// SPDX-License-Identifier: BSD-3-Clause
// Searches the place of a map that the last keyframes of an odometry show, by appearance alone. Since there is no prior
// pose that could rule out a wrong place (another odometry, a loaded map), the keyframes of a second or two are judged
// together, they must explain what the map predicts to be visible, and a second place that fits about as well leads to
// a refusal.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_support.h"
#include "vip_slam_backend/loop/place_verifier.h"
#include "vip_slam_backend/place_recognition/keyframe_database.h"

namespace vip_slam {

class PlaceSearch {
 public:
  explicit PlaceSearch(const RelocalisationOptions& options) : options_(options) {}

  /// Adds the next keyframe; one of another odometry (epoch) restarts the search. `bow`: of the keyframe. Places are
  /// taken from keyframes accepted by `allowed` (empty: all). Accepted with the pose of this keyframe, or refused with
  /// the reason. `part_of`: part of the map that a keyframe lies in (empty: a single part). The relative pose of parts
  /// that no loop ties is a guess, so evidence is not combined across parts.
  PlaceVerification add(const Map& map, const KeyframeDatabase& database, const PlaceVerifier& verifier,
                        const KeyframePtr& keyframe, const BowResult& bow,
                        const std::function<bool(KeyframeId)>& allowed,
                        const std::function<std::uint32_t(KeyframeId)>& part_of = {});
  void clear();

 private:
  struct Place {
    SE3 T_W_odom;
    std::uint32_t part = 0;
  };
  struct Guess {
    Place place;
    PlaceSupport support;
  };
  /// Input of the search with one keyframe.
  struct Scene {
    const Map& map;
    const KeyframeDatabase& database;
    const PlaceVerifier& verifier;
    const std::function<bool(KeyframeId)>& allowed;
    const std::function<std::uint32_t(KeyframeId)>& part_of;
    std::vector<KeyframeId> views;  ///< keyframes similar to the newest, one per view, best first

    std::uint32_t partOf(KeyframeId id) const { return part_of ? part_of(id) : 0; }
  };
  std::vector<KeyframeId> viewsLikeNewest(const Scene& scene) const;
  /// Hypotheses of the odometry's pose from pairs of descriptor matches of all keyframes with the views [first, last),
  /// one per place, best first, at most `most`.
  std::vector<Place> guesses(const Scene& scene, std::size_t first, std::size_t last, std::size_t most) const;
  /// Adds the support of new places to guesses_ and sorts them.
  void weigh(const Scene& scene, const std::vector<Place>& places);
  PlaceVerification judge(const Scene& scene) const;
  /// Reasons, as text, why the strongest place is not accepted with a single keyframe; empty: it is accepted.
  std::vector<std::string> doubts() const;

  RelocalisationOptions options_;
  std::vector<KeyframePtr> keyframes_;  ///< keyframes of the last seconds, oldest first
  std::vector<BowResult> bows_;         ///< of each keyframe
  std::vector<Guess> guesses_;          ///< hypotheses with support of some of them, strongest first
  std::optional<Place> believed_;       ///< result of the keyframe before, if it had at most one doubt
};

}  // namespace vip_slam
