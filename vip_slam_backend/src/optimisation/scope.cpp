// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

ProblemScope localScope(const Map& map, const LocalBaOptions& options) {
  ProblemScope scope;
  for (auto it = map.keyframes().rbegin();
       it != map.keyframes().rend() && static_cast<int>(scope.free.size()) < options.window; ++it)
    scope.free.push_back(it->first);
  std::sort(scope.free.begin(), scope.free.end());
  const std::set<KeyframeId> free(scope.free.begin(), scope.free.end());
  std::set<KeyframeId> fixed;
  for (const KeyframeId id : scope.free) {
    const KeyframeId previous = map.keyframe(id).previous;
    if (previous != 0 && !free.count(previous)) fixed.insert(previous);
  }
  // Observers outside, by the number of landmarks they share with the window.
  std::map<KeyframeId, int> shared;
  std::set<LandmarkId> seen;
  for (const KeyframeId id : scope.free)
    for (const LandmarkId landmark : map.keyframe(id).landmarks)
      if (landmark != kNoLandmark && seen.insert(landmark).second)
        for (const MapObservation& o : map.landmark(landmark).observations)
          if (!free.count(o.keyframe)) ++shared[o.keyframe];
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& s : shared) ranked.emplace_back(s.second, s.first);
  std::sort(ranked.rbegin(), ranked.rend());
  for (std::size_t k = 0; k < ranked.size() && static_cast<int>(k) < options.max_fixed_keyframes; ++k)
    fixed.insert(ranked[k].second);
  scope.fixed.assign(fixed.begin(), fixed.end());
  return scope;
}

ProblemScope globalScope(const Map& map) {
  ProblemScope scope;
  for (const auto& entry : map.keyframes()) scope.free.push_back(entry.first);
  return scope;
}

}  // namespace vip_slam
