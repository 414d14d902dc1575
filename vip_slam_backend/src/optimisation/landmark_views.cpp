// SPDX-License-Identifier: BSD-3-Clause
#include "landmark_views.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_core/types/sliding_tracks.h"

namespace vip_slam {
namespace {

void prefetch(const void* p, std::size_t bytes) {
  const char* at = static_cast<const char*>(p);
  for (std::size_t k = 0; k < bytes; k += 64) __builtin_prefetch(at + k);
  __builtin_prefetch(at + bytes - 1);
}

double depthIn(const Map& map, KeyframeId keyframe, const Eigen::Vector3d& p_W) {
  const SE3 T_W_C = map.keyframe(keyframe).T_W_C();
  return std::max(kMinProjectionDepth, T_W_C.R().col(2).dot(p_W - T_W_C.t()));
}

}  // namespace

LandmarkViews::LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes,
                             const PixelNoise& noise) {
  std::vector<const MapLandmark*> landmarks;
  if (scope.free.size() == map.keyframes().size()) {
    landmarks.reserve(map.landmarks().size());
    for (const auto& entry : map.landmarks()) landmarks.push_back(&entry.second);
  } else {
    std::vector<LandmarkId> ids;
    for (const KeyframeId id : scope.free)
      for (const LandmarkId landmark : map.keyframe(id).landmarks)
        if (landmark != kNoLandmark) ids.push_back(landmark);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const LandmarkId id : ids) landmarks.push_back(&map.landmark(id));
  }
  std::sort(landmarks.begin(), landmarks.end(), [](const auto* a, const auto* b) { return a->id < b->id; });

  // Keyframes lie close together in their ids: a table finds a frame without hashing.
  lowest_ = keyframes.empty() ? 0 : keyframes.front();
  std::size_t most = 0;
  for (std::size_t f = 0; f < keyframes.size(); ++f) {
    frame_of_.resize(keyframes[f] - lowest_ + 1, -1);
    frame_of_.back() = static_cast<int>(f);
    features_.push_back(map.keyframe(keyframes[f]).features().data());
    most += map.keyframe(keyframes[f]).features().size();
  }
  first_.reserve(landmarks.size() + 1);
  points_.reserve(landmarks.size());
  views_.reserve(most);
  const std::size_t count = landmarks.size();
  for (std::size_t l = 0; l < count; ++l) {  // prefetched: the landmark, the list of its observations, their features
    if (l + 3 * kAhead < count) prefetch(landmarks[l + 3 * kAhead], sizeof(MapLandmark));
    if (l + 2 * kAhead < count) {
      const auto& list = landmarks[l + 2 * kAhead]->observations;
      prefetch(list.data(), list.size() * sizeof(MapObservation));
    }
    if (l + kAhead < count) {
      collect(*landmarks[l + kAhead]);
      for (const Seen& s : seen_) prefetch(s.feature, offsetof(Feature, descriptor));
    }
    collect(*landmarks[l]);
    addPoints(map, *landmarks[l], keyframes, noise);
  }
  first_.push_back(viewCount());
}

double LandmarkViews::cornersApart(const Track& a, const Track& b, double depth) {
  return std::hypot(a.first_depth, b.first_depth) / depth;
}

void LandmarkViews::collect(const MapLandmark& landmark) {
  seen_.clear();
  for (const MapObservation& o : landmark.observations) {
    if (o.keyframe < lowest_ || o.keyframe - lowest_ >= frame_of_.size()) continue;
    const int frame = frame_of_[o.keyframe - lowest_];
    if (frame >= 0) seen_.push_back({frame, o.feature, features_[frame] + o.feature});
  }
}

void LandmarkViews::addView(const Seen& seen, bool own_track, double apart, const PixelNoise& noise) {
  const Feature& f = *seen.feature;
  views_.push_back({seen.frame, seen.feature_index, f.xy, f.depth, f.depth_sigma, noise.sigma(f, own_track, apart),
                    own_track, own_track && f.pixel_sigma > kSlidingPixelSigma});
}

void LandmarkViews::findFirstDepths(const Map& map, const MapLandmark& landmark) {
  std::size_t missing = tracks_.size();
  for (const MapObservation& o : landmark.observations) {
    const LandmarkId id = map.feature(o).id;
    for (Track& track : tracks_) {
      if (track.id != id || track.first_depth > 0) continue;
      track.first_depth = depthIn(map, o.keyframe, landmark.p_W);
      --missing;
    }
    if (missing == 0) return;
  }
}

void LandmarkViews::addPoints(const Map& map, const MapLandmark& landmark, const std::vector<KeyframeId>& keyframes,
                              const PixelNoise& noise) {
  const auto trackOf = [this](LandmarkId id) {
    return std::find_if(tracks_.begin(), tracks_.end(), [id](const Track& t) { return t.id == id; });
  };
  tracks_.clear();
  for (const Seen& s : seen_) {
    if (s.feature->id == kNoLandmark) continue;
    const auto known = trackOf(s.feature->id);
    if (known == tracks_.end())
      tracks_.push_back({s.feature->id, 1, 0, 0});
    else
      ++known->views;
  }
  const auto longest = std::max_element(tracks_.begin(), tracks_.end(),
                                        [](const Track& a, const Track& b) { return a.views < b.views; });
  points_.push_back(&landmark);
  first_.push_back(viewCount());
  // Other tracks are tied to the longest one by their middle view.
  for (Track& track : tracks_) track.until_tie = track.views / 2;
  if (tracks_.size() > 1) findFirstDepths(map, landmark);
  for (const Seen& s : seen_) {
    const auto track = trackOf(s.feature->id);
    if (track == tracks_.end() || track == longest)
      addView(s, track != tracks_.end(), 1, noise);
    else if (track->until_tie-- == 0)
      addView(s, false, cornersApart(*longest, *track, depthIn(map, keyframes[s.frame], landmark.p_W)), noise);
  }
  for (auto track = tracks_.begin(); track != tracks_.end(); ++track) {
    if (track == longest || track->views < 2) continue;
    points_.push_back(&landmark);
    first_.push_back(viewCount());
    for (const Seen& s : seen_)
      if (s.feature->id == track->id) addView(s, true, 1, noise);
  }
}

}  // namespace vip_slam
