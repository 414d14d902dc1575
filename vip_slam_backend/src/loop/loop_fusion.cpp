// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/loop_fusion.h"

namespace vip_slam {

int fuseLandmarks(Map& map, KeyframeId query, const std::vector<std::pair<std::uint32_t, LandmarkId>>& pairs) {
  const Eigen::Vector3d eye = map.keyframe(query).T_W_C().t();
  int joined = 0;
  for (const auto& pair : pairs) {
    // An earlier pair may have merged either landmark.
    const LandmarkId into = map.resolve(pair.second);
    const LandmarkId own = map.keyframe(query).landmarks[pair.first];
    if (own == into || !map.hasLandmark(into)) continue;
    if (own == kNoLandmark) {
      joined += map.addObservation(into, {query, pair.first});
      continue;
    }
    // Landmarks within the accuracy of depth and of the loop correction count as one point.
    const Eigen::Vector3d& p_W = map.landmark(into).p_W;
    if ((map.landmark(own).p_W - p_W).norm() > 0.03 + 0.02 * (p_W - eye).norm()) continue;
    joined += map.mergeLandmarks(own, into);
  }
  return joined;
}

}  // namespace vip_slam
