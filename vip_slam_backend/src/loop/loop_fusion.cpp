#include "vip_slam_backend/loop/loop_fusion.h"

namespace vip_slam {

int fuseLandmarks(Map& map, KeyframeId query, const std::vector<std::pair<std::uint32_t, LandmarkId>>& pairs,
                  double max_distance) {
  int joined = 0;
  for (const auto& pair : pairs) {
    // An earlier pair may have merged either side away.
    const LandmarkId into = map.resolve(pair.second);
    const LandmarkId own = map.keyframe(query).landmarks[pair.first];
    if (own == into || !map.hasLandmark(into)) continue;
    if (own == kNoLandmark) {
      joined += map.addObservation(into, {query, pair.first});
      continue;
    }
    if ((map.landmark(own).p_W - map.landmark(into).p_W).norm() > max_distance) continue;
    joined += map.mergeLandmarks(own, into);
  }
  return joined;
}

}  // namespace vip_slam
