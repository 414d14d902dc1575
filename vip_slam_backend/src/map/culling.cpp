// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/map/culling.h"

#include <algorithm>
#include <set>
#include <utility>

namespace vip_slam {
namespace {

// With this many views a landmark is kept however often it was not found: predictions do not model occlusion, and the
// views of its own track count neither as predicted nor as found. One view of a landmark or plane with as many is
// redundant.
constexpr std::size_t kProven = 4;

constexpr std::size_t kSmallMap = 3;  // times above_covisible: smaller maps have no crowds, since they cost little
constexpr std::size_t kAtOnce = 2;    // removed from crowds per call, since each removal changes the crowd

/// Keyframes to judge now, oldest first: as many as are in the window of those that just left it, and as many of the
/// older ones in turn.
std::vector<KeyframeId> candidates(const Map& map, int window) {
  std::vector<KeyframeId> ids;
  for (const auto& entry : map.keyframes()) ids.push_back(entry.first);
  const int older = static_cast<int>(ids.size()) - 2 * window;
  std::vector<KeyframeId> list;
  if (older > 0) {
    const int parts = (older + window - 1) / window, part = static_cast<int>(ids.back() % KeyframeId(parts));
    for (int k = part; k < older; k += parts) list.push_back(ids[static_cast<std::size_t>(k)]);
  }
  list.insert(list.end(), ids.begin() + std::max(0, older), ids.end() - window);
  return list;
}

/// Ends of the oldest loop between each two odometries, which would be separate parts of the map without them.
std::set<KeyframeId> endsOfTies(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> tied;
  std::set<KeyframeId> ends;
  for (const auto& [query, match] : loops) {
    if (!map.hasKeyframe(query) || !map.hasKeyframe(match)) continue;
    const std::uint32_t a = map.keyframe(query).data->frame.epoch, b = map.keyframe(match).data->frame.epoch;
    if (a == b || !tied.insert(std::minmax(a, b)).second) continue;
    ends.insert(query);
    ends.insert(match);
  }
  return ends;
}

/// Whether enough other keyframes observe the plane; searched from the neighbours in time, which mostly do.
bool isHeldByOthers(PlaneId plane, const MapKeyframe& kf, const Map& map) {
  std::size_t views = 1;
  const auto here = map.keyframes().find(kf.id());
  auto before = here, after = std::next(here);
  while (views < kProven && (before != map.keyframes().begin() || after != map.keyframes().end())) {
    if (before != map.keyframes().begin()) views += (--before)->second.planes.count(plane) != 0;
    if (after != map.keyframes().end()) views += (after++)->second.planes.count(plane) != 0;
  }
  return views >= kProven;
}

/// Whether enough landmarks and all planes are seen elsewhere; landmarks with fewer than `proven` views do not count.
bool isRedundant(const MapKeyframe& kf, const Map& map, double redundancy, std::size_t proven) {
  int total = 0, redundant = 0;
  for (const LandmarkId landmark : kf.landmarks) {
    if (landmark == kNoLandmark) continue;
    const std::size_t views = map.landmark(landmark).observations.size();
    total += views >= proven;
    redundant += views >= kProven;
  }
  if (total < 20 || redundant < redundancy * total) return false;
  // A keyframe whose planes too few others observe stays.
  return std::all_of(kf.planes.begin(), kf.planes.end(),
                     [&](const auto& plane) { return isHeldByOthers(plane.first, kf, map); });
}

}  // namespace

int cullLandmarks(KeyframeId recent, Map* map) {
  const auto& keyframes = map->keyframes();
  const int window = static_cast<int>(std::distance(keyframes.lower_bound(recent), keyframes.end()));
  if (window >= static_cast<int>(keyframes.size())) return 0;
  int removed = 0;
  for (const KeyframeId keyframe : candidates(*map, window)) {
    for (const LandmarkId id : std::vector<LandmarkId>(map->keyframe(keyframe).landmarks)) {
      if (id == kNoLandmark) continue;
      const MapLandmark& landmark = map->landmark(id);
      if (landmark.observations.back().keyframe >= recent) continue;
      const std::size_t views = landmark.observations.size();
      const bool poor = views < 3 || (views < kProven && 5 * landmark.found < landmark.visible);
      if (!poor) continue;
      map->removeLandmark(id);
      ++removed;
    }
  }
  return removed;
}

std::vector<KeyframeId> cullKeyframes(const CullingOptions& options, int window, const ImuNoise& noise,
                                      const std::vector<std::pair<KeyframeId, KeyframeId>>& loops, Map* map) {
  std::vector<KeyframeId> removed;
  if (!options.enabled || map->keyframes().size() <= static_cast<std::size_t>(window)) return removed;
  const bool too_large = map->keyframes().size() > static_cast<std::size_t>(std::max(3, options.above_keyframes));
  const bool crowds = map->keyframes().size() > kSmallMap * static_cast<std::size_t>(options.above_covisible);
  if (!too_large && !crowds) return removed;
  const std::set<KeyframeId> ties = endsOfTies(*map, loops);
  std::size_t out_of_crowds = 0;
  for (const KeyframeId id : candidates(*map, window)) {
    const MapKeyframe& kf = map->keyframe(id);
    if (!map->joinable(kf)) continue;
    // Number of covisible keyframes relative to the limit.
    const double crowd =
        crowds ? static_cast<double>(map->covisible(id).size()) / static_cast<double>(options.above_covisible) : 0.0;
    if (!too_large && (crowd <= 1 || out_of_crowds >= kAtOnce)) continue;
    // In a room that is seen again and again every keyframe is the end of some loop, whose information the shared
    // landmarks have as well.
    if (kf.loop_keyframe && (crowd <= 1 || ties.count(id) != 0)) continue;
    // With a fixed limit on the IMU factor a room's keyframes would grow with the time spent there. The limit rises
    // steeply, so that keyframes outside crowds keep their IMU factors.
    const double longest = options.max_imu_seconds * std::max(crowd * crowd * crowd, 1.0);
    if (map->joinedSeconds(kf) > longest) continue;
    // In a crowd a landmark that only few keyframes saw is a mismatch or has moved.
    if (!isRedundant(kf, *map, options.redundancy, crowd > 1 ? kProven : 1)) continue;
    map->removeKeyframe(id, noise, longest);
    removed.push_back(id);
    out_of_crowds += crowd > 1;
  }
  return removed;
}

}  // namespace vip_slam
