#include "vip_slam_backend/map/culling.h"

namespace vip_slam {

int cullLandmarks(KeyframeId recent, Map* map) {
  int removed = 0;
  for (const LandmarkId id : map->landmarkIds()) {
    const MapLandmark& landmark = map->landmark(id);
    if (landmark.observations.back().keyframe >= recent) continue;
    const bool poor = landmark.observations.size() < 3 || 5 * landmark.found < landmark.visible;
    if (!poor) continue;
    map->removeLandmark(id);
    ++removed;
  }
  return removed;
}

std::vector<KeyframeId> cullKeyframes(const CullingOptions& options, int window, const ImuNoise& noise, Map* map) {
  std::vector<KeyframeId> removed;
  if (!options.enabled || map->keyframes().size() <= static_cast<std::size_t>(window)) return removed;
  // Only keyframes that just left the window: older ones were judged when they did.
  std::vector<KeyframeId> candidates;
  int newest = 0;
  for (auto it = map->keyframes().rbegin(); it != map->keyframes().rend() && newest < window + 10; ++it, ++newest)
    if (newest >= window) candidates.push_back(it->first);
  for (const KeyframeId id : candidates) {
    const MapKeyframe& kf = map->keyframe(id);
    if (kf.loop_keyframe || kf.previous == 0 || kf.next == 0 || !kf.imu || !map->keyframe(kf.next).imu) continue;
    if (map->keyframe(kf.next).imu->back().t - kf.imu->front().t > options.max_imu_seconds) continue;
    int total = 0, redundant = 0;
    for (const LandmarkId landmark : kf.landmarks) {
      if (landmark == kNoLandmark) continue;
      ++total;
      redundant += map->landmark(landmark).observations.size() >= 4;
    }
    if (total < 20 || redundant < options.redundancy * total) continue;
    // A keyframe that alone holds a plane stays.
    bool needed = false;
    for (const auto& plane : kf.planes) {
      int others = 0;
      for (const auto& entry : map->keyframes()) others += entry.first != id && entry.second.planes.count(plane.first);
      needed |= others < 3;
    }
    if (needed) continue;
    map->removeKeyframe(id, noise, options.max_imu_seconds);
    removed.push_back(id);
  }
  return removed;
}

}  // namespace vip_slam
