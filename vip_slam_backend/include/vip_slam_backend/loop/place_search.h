// The one place of a map that the last keyframes of an odometry show, told by their looks alone. Nothing else speaks
// against a wrong place here (another odometry, a loaded map), so the keyframes of a second or two are judged
// together, they must explain what the map says is to be seen there, and a second place that fits about as well makes
// it refuse.
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

  /// The next keyframe; one of another odometry (epoch) begins anew. `bow`: of the keyframe. Places are taken from
  /// keyframes that `allowed` lets pass (empty: all). Accepted with the pose of this keyframe, or refused with the
  /// reason. `part_of`: which part of the map a keyframe lies in (empty: all in one). Parts that nothing ties lie over
  /// each other by a guess: what several of them show speaks for no place together.
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
  /// What the search of one keyframe runs on.
  struct Scene {
    const Map& map;
    const KeyframeDatabase& database;
    const PlaceVerifier& verifier;
    const std::function<bool(KeyframeId)>& allowed;
    const std::function<std::uint32_t(KeyframeId)>& part_of;
    std::vector<KeyframeId> views;  ///< keyframes that look like the newest, one a view, best first

    std::uint32_t partOf(KeyframeId id) const { return part_of ? part_of(id) : 0; }
  };
  std::vector<KeyframeId> viewsLikeNewest(const Scene& scene) const;
  /// Where pairs of descriptor matches of all keyframes put the odometry if it were at one of the views [first, last),
  /// one a place, best first, at most `most`.
  std::vector<Place> guesses(const Scene& scene, std::size_t first, std::size_t last, std::size_t most) const;
  /// Adds to guesses_ what speaks for places that are not among them, and sorts them.
  void weigh(const Scene& scene, const std::vector<Place>& places);
  PlaceVerification judge(const Scene& scene) const;
  /// Why the strongest place is not believed on the word of one keyframe, in words; empty: it is.
  std::vector<std::string> doubts() const;

  RelocalisationOptions options_;
  std::vector<KeyframePtr> keyframes_;  ///< of the last seconds, oldest first
  std::vector<BowResult> bows_;         ///< of each
  std::vector<Guess> guesses_;          ///< places that some of them spoke for, strongest first
  std::optional<Place> believed_;       ///< what the keyframe before came to
};

}  // namespace vip_slam
