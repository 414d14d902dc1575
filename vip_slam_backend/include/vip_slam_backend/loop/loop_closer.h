// SPDX-License-Identifier: BSD-3-Clause
// Loop closing (paper section "Loop Detection and Pose Plane Graph Optimization"): recognises places, verifies them,
// corrects the map by the pose-plane graph and fuses landmarks. A loop is accepted only when appearance, neighbouring
// keyframes, geometry, gravity, depth, planes and odometry agree.
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

  /// Adds a keyframe of the map to the database.
  void add(const Map& map, KeyframeId id);
  /// Rebuilds the database from all keyframes of the map (after loading one).
  void rebuild(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops);
  /// Looks for a loop at a keyframe that add() knows. On success the map is corrected and fused: all keyframes,
  /// landmarks and planes may have moved. One event per verified candidate; the accepted one is the last.
  std::vector<LoopEvent> close(Map& map, KeyframeId query);
  /// Forgets a keyframe that was removed from the map, and its loops.
  void remove(KeyframeId id);
  void clear();
  /// Adds a relocalised keyframe as a loop: its epoch and that of `match` become one part of the map.
  void tie(Map& map, KeyframeId query, KeyframeId match);
  /// Whether the odometry of `id` is tied to the rest of the map.
  bool tied(const Map& map, KeyframeId id) const;

  /// (query, match) of the accepted loops, oldest first.
  const std::vector<std::pair<KeyframeId, KeyframeId>>& loops() const { return loops_; }
  const Vocabulary& vocabulary() const { return *vocabulary_; }
  const KeyframeDatabase& database() const { return database_; }
  const PlaceVerifier& verifier() const { return verifier_; }
  BowResult describe(const Keyframe& keyframe) const;

 private:
  /// Keyframes of the query's own part of the map with similar appearance, one per place, best first.
  std::vector<KeyframeId> candidates(const Map& map, KeyframeId query, const std::set<KeyframeId>& part);
  /// Whether a keyframe is of another odometry, or so old that the query's pose does not depend on it directly.
  bool isOld(const Map& map, KeyframeId id, const Keyframe& query) const;
  /// Searches the query in those parts of the map that are not tied to its own part yet.
  LoopEvent joinParts(Map& map, KeyframeId query, const std::set<KeyframeId>& part);
  /// Description of another place that fits the query as well, when `place` is far from the query's pose in the map: an
  /// ambiguous appearance is no evidence. Empty: there is none.
  std::string rival(const Map& map, KeyframeId query, const PlaceVerification& place,
                    const std::vector<KeyframeId>& candidates, const std::function<bool(KeyframeId)>& old) const;
  /// Corrects the map by a verified place, unless its planes or the pose-plane graph contradict it.
  LoopEvent correct(Map& map, KeyframeId query, const PlaceVerification& place);
  void fuse(Map& map, KeyframeId query, const PlaceVerification& place);

  LoopOptions options_;
  TimingLog* timing_;
  std::shared_ptr<const Vocabulary> vocabulary_;
  KeyframeDatabase database_;
  PlaceVerifier verifier_;
  std::vector<std::pair<KeyframeId, KeyframeId>> loops_;
  PlaceSearch joins_;                               ///< for the newest part of the map while it is not tied to the rest
  std::deque<std::set<KeyframeId>> recent_places_;  ///< candidate neighbourhoods of the last keyframes, newest last
};

}  // namespace vip_slam
