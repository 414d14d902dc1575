// Loop closing: recognises places, verifies them, corrects the map by the pose-plane graph and fuses landmarks.
// A loop is taken only when appearance, neighbouring keyframes, geometry, gravity, depth, planes and odometry agree.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_search.h"
#include "vip_slam_backend/loop/place_verifier.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/place_recognition/keyframe_database.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/util/timing.h"

namespace vip_slam {

class LoopCloser {
 public:
  /// Throws std::runtime_error when the vocabulary of the options cannot be read. `timing` may be null.
  LoopCloser(const LoopOptions& options, std::shared_ptr<const CameraModel> camera, TimingLog* timing = nullptr);

  /// Enters a keyframe of the map into the database.
  void add(const Map& map, KeyframeId id);
  /// Enters all keyframes of the map anew (after loading one).
  void rebuild(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);
  /// Looks for a loop at a keyframe that add() knows. On success the map is corrected and fused: all keyframes,
  /// landmarks and planes may have moved. One event per verified candidate; the accepted one is the last.
  std::vector<LoopEvent> close(Map& map, KeyframeId query);
  /// A keyframe that left the map, with its loops.
  void remove(KeyframeId id);
  void clear();
  /// A relocalised keyframe: from now on its epoch and that of `match` are one part of the map.
  void tie(Map& map, KeyframeId query, KeyframeId match);
  /// Whether the odometry of `id` is known relative to all else.
  bool tied(const Map& map, KeyframeId id) const;

  /// (query, match) of the accepted loops, oldest first.
  const std::vector<std::pair<KeyframeId, KeyframeId>>& loops() const { return loops_; }
  const Vocabulary& vocabulary() const { return *vocabulary_; }
  const KeyframeDatabase& database() const { return database_; }
  const PlaceVerifier& verifier() const { return verifier_; }
  BowResult describe(const Keyframe& keyframe) const;

 private:
  /// Keyframes of the query's own part of the map that look like it, one a place, best first.
  std::vector<KeyframeId> candidates(const Map& map, KeyframeId query, const std::set<KeyframeId>& part);
  /// Of another odometry or so long ago that the query does not follow from it.
  bool isOld(const Map& map, KeyframeId id, const Keyframe& query) const;
  /// Looks for the query in those parts of the map that nothing ties to its own yet.
  LoopEvent joinParts(Map& map, KeyframeId query, const std::set<KeyframeId>& part);
  /// Where the query would be as well, in words, when `place` lies elsewhere than the map has it: what looks alike is no
  /// place. Empty: nowhere.
  std::string rival(const Map& map, KeyframeId query, const PlaceVerification& place,
                    const std::vector<KeyframeId>& candidates, const std::function<bool(KeyframeId)>& old) const;
  /// The map's veto on a place that was verified, or the correction.
  LoopEvent correct(Map& map, KeyframeId query, const PlaceVerification& place);
  void fuse(Map& map, KeyframeId query, const PlaceVerification& place);

  LoopOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  TimingLog* timing_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  KeyframeDatabase database_;
  PlaceVerifier verifier_;
  std::vector<std::pair<KeyframeId, KeyframeId>> loops_;
  PlaceSearch joins_;  ///< for the newest part of the map when nothing ties it to the rest yet
  std::deque<std::set<KeyframeId>> recent_places_;  ///< neighbourhoods that the last keyframes pointed to, newest last
};

}  // namespace vip_slam
