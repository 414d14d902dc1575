#include "landmark_views.h"

#include <algorithm>

namespace vip_slam {

LandmarkViews::LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes) {
  if (scope.free.size() == map.keyframes().size()) {
    landmarks_.reserve(map.landmarks().size());
    for (const auto& entry : map.landmarks()) landmarks_.push_back(&entry.second);
  } else {
    std::vector<LandmarkId> ids;
    for (const KeyframeId id : scope.free)
      for (const LandmarkId landmark : map.keyframe(id).landmarks)
        if (landmark != kNoLandmark) ids.push_back(landmark);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const LandmarkId id : ids) landmarks_.push_back(&map.landmark(id));
  }
  std::sort(landmarks_.begin(), landmarks_.end(), [](const auto* a, const auto* b) { return a->id < b->id; });

  // Keyframes lie close together in their ids: a table finds a frame without hashing.
  std::vector<const Feature*> features;
  std::vector<int> frame_of;
  const KeyframeId lowest = keyframes.empty() ? 0 : keyframes.front();
  for (std::size_t f = 0; f < keyframes.size(); ++f) {
    frame_of.resize(keyframes[f] - lowest + 1, -1);
    frame_of.back() = static_cast<int>(f);
    features.push_back(map.keyframe(keyframes[f]).features().data());
  }
  first_.reserve(landmarks_.size() + 1);
  for (const MapLandmark* landmark : landmarks_) {
    first_.push_back(viewCount());
    for (const MapObservation& o : landmark->observations) {
      if (o.keyframe < lowest || o.keyframe - lowest >= frame_of.size()) continue;
      const int frame = frame_of[o.keyframe - lowest];
      if (frame >= 0) views_.push_back({frame, o.feature, features[frame] + o.feature});
    }
  }
  first_.push_back(viewCount());
}

}  // namespace vip_slam
