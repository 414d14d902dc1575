#include "vip_slam_backend/map/culling.h"

#include <algorithm>
#include <map>
#include <set>

namespace vip_slam {
namespace {

// Views that prove a landmark, however often it was looked for in vain: predictions know of nothing that hides it, and
// the views of its own track count neither as predicted nor as found.
constexpr std::size_t kProven = 4;

constexpr int kJudged = 10;                // keyframes that just left the window, and as many older ones in turn
constexpr std::size_t kSmallMap = 3;       // times the keyframes that are a crowd: all together they cost little
constexpr std::size_t kAtOnce = 2;         // out of a crowd, which is another one without them
constexpr double kLongest = 10.0;          // times the longest IMU factor, in a crowd
constexpr int kTies = 5;                   // loops between two odometries that are kept
constexpr std::size_t kSeenElsewhere = 4;  // views of a landmark that can do without one

/// Those whose time has come, oldest first: what just left the window, and each older one again and again.
std::vector<KeyframeId> candidates(const Map& map, int window) {
  std::vector<KeyframeId> ids;
  for (const auto& entry : map.keyframes()) ids.push_back(entry.first);
  const int older = static_cast<int>(ids.size()) - window - kJudged;
  std::vector<KeyframeId> list;
  if (older > 0) {
    const int parts = (older + kJudged - 1) / kJudged, part = static_cast<int>(ids.back() % KeyframeId(parts));
    for (int k = part; k < older; k += parts) list.push_back(ids[static_cast<std::size_t>(k)]);
  }
  list.insert(list.end(), ids.begin() + std::max(0, older), ids.end() - window);
  return list;
}

/// Ends of the oldest few loops between each two odometries: without any these would be parts that nothing ties.
std::set<KeyframeId> endsOfTies(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
  std::set<KeyframeId> ends;
  for (const auto& [query, match] : loops) {
    if (!map.hasKeyframe(query) || !map.hasKeyframe(match)) continue;
    const std::uint32_t a = map.keyframe(query).data->frame.epoch, b = map.keyframe(match).data->frame.epoch;
    if (a == b || ++count[std::minmax(a, b)] > kTies) continue;
    ends.insert(query);
    ends.insert(match);
  }
  return ends;
}

/// Three more at least: neighbours in time mostly see what a keyframe sees.
bool isHeldByOthers(PlaneId plane, const MapKeyframe& kf, const Map& map) {
  constexpr int kEnough = 3;
  int others = 0;
  const auto here = map.keyframes().find(kf.id());
  auto before = here, after = std::next(here);
  while (others < kEnough && (before != map.keyframes().begin() || after != map.keyframes().end())) {
    if (before != map.keyframes().begin()) others += (--before)->second.planes.count(plane) != 0;
    if (after != map.keyframes().end()) others += (after++)->second.planes.count(plane) != 0;
  }
  return others >= kEnough;
}

/// Landmarks with fewer than `proven` views do not count.
bool isRedundant(const MapKeyframe& kf, const Map& map, double redundancy, std::size_t proven) {
  int total = 0, redundant = 0;
  for (const LandmarkId landmark : kf.landmarks) {
    if (landmark == kNoLandmark) continue;
    const std::size_t views = map.landmark(landmark).observations.size();
    total += views >= proven;
    redundant += views >= kSeenElsewhere;
  }
  if (total < 20 || redundant < redundancy * total) return false;
  // A keyframe that alone holds a plane stays.
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
    if (kf.previous == 0 || kf.next == 0 || !kf.imu || !map->keyframe(kf.next).imu) continue;
    // How far the keyframes around it are more than enough.
    const double crowd =
        crowds ? static_cast<double>(map->covisible(id).size()) / static_cast<double>(options.above_covisible) : 0.0;
    if (!too_large && (crowd <= 1 || out_of_crowds >= kAtOnce)) continue;
    // Where a room is seen again and again every keyframe is the end of some loop, and landmarks say the same.
    if (kf.loop_keyframe && (crowd <= 1 || ties.count(id) != 0)) continue;
    // A limit on time alone lets a room grow for as long as one stays in it; steep, so that what is no crowd keeps its
    // IMU.
    const double longest = options.max_imu_seconds * std::clamp(crowd * crowd * crowd, 1.0, kLongest);
    if (map->keyframe(kf.next).imu->back().t - kf.imu->front().t > longest) continue;
    // In a crowd a landmark that few of so many saw is a mistake or has moved.
    if (!isRedundant(kf, *map, options.redundancy, crowd > 1 ? kSeenElsewhere : 1)) continue;
    map->removeKeyframe(id, noise, longest);
    removed.push_back(id);
    out_of_crowds += crowd > 1;
  }
  return removed;
}

}  // namespace vip_slam
