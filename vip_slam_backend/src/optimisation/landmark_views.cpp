#include "landmark_views.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

// Views of one track among those of a landmark.
struct TrackOfLandmark {
  LandmarkId id;
  int views;
};

constexpr double kLeastDepth = 0.05, kMostApart = 4.0;

double depthIn(const Map& map, KeyframeId keyframe, const Eigen::Vector3d& p_W) {
  const SE3 T_W_C = map.keyframe(keyframe).T_W_C();
  return std::max(kLeastDepth, T_W_C.R().col(2).dot(p_W - T_W_C.t()));
}

// Depth of a landmark where one of its tracks began, as far as the map knows.
double firstDepth(const Map& map, const MapLandmark& landmark, LandmarkId track) {
  for (const MapObservation& o : landmark.observations)
    if (map.feature(o).id == track) return depthIn(map, o.keyframe, landmark.p_W);
  return kLeastDepth;
}

// See LandmarkView::apart.
double cornersApart(const Map& map, const MapLandmark& landmark, LandmarkId a, LandmarkId b, KeyframeId here) {
  const double depth = depthIn(map, here, landmark.p_W);
  return std::min(kMostApart, std::hypot(firstDepth(map, landmark, a), firstDepth(map, landmark, b)) / depth);
}

std::vector<TrackOfLandmark> tracksOf(const std::vector<LandmarkView>& views) {
  std::vector<TrackOfLandmark> tracks;
  for (const LandmarkView& v : views) {
    if (v.feature->id == kNoLandmark) continue;
    const auto known =
        std::find_if(tracks.begin(), tracks.end(), [&v](const auto& t) { return t.id == v.feature->id; });
    if (known == tracks.end())
      tracks.push_back({v.feature->id, 1});
    else
      ++known->views;
  }
  return tracks;
}

}  // namespace

LandmarkViews::LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes) {
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
  std::vector<const Feature*> features;
  std::vector<int> frame_of;
  const KeyframeId lowest = keyframes.empty() ? 0 : keyframes.front();
  for (std::size_t f = 0; f < keyframes.size(); ++f) {
    frame_of.resize(keyframes[f] - lowest + 1, -1);
    frame_of.back() = static_cast<int>(f);
    features.push_back(map.keyframe(keyframes[f]).features().data());
  }
  first_.reserve(landmarks.size() + 1);
  points_.reserve(landmarks.size());
  std::vector<LandmarkView> seen;
  for (const MapLandmark* landmark : landmarks) {
    seen.clear();
    for (const MapObservation& o : landmark->observations) {
      if (o.keyframe < lowest || o.keyframe - lowest >= frame_of.size()) continue;
      const int frame = frame_of[o.keyframe - lowest];
      if (frame >= 0) seen.push_back({frame, true, o.feature, features[frame] + o.feature});
    }
    addPoints(map, *landmark, keyframes, seen);
  }
  first_.push_back(viewCount());
}

void LandmarkViews::addPoints(const Map& map, const MapLandmark& landmark, const std::vector<KeyframeId>& keyframes,
                              std::vector<LandmarkView>& seen) {
  const std::vector<TrackOfLandmark> tracks = tracksOf(seen);
  const auto longest = std::max_element(tracks.begin(), tracks.end(),
                                        [](const auto& a, const auto& b) { return a.views < b.views; });
  points_.push_back(&landmark);
  first_.push_back(viewCount());
  // Of each other track the view in its middle.
  std::vector<int> until_tie;
  for (const TrackOfLandmark& track : tracks) until_tie.push_back(track.views / 2);
  for (LandmarkView& view : seen) {
    const auto track =
        std::find_if(tracks.begin(), tracks.end(), [&view](const auto& t) { return t.id == view.feature->id; });
    view.own_track = track != tracks.end() && track == longest;
    const bool tie = !view.own_track && track != tracks.end() && until_tie[track - tracks.begin()]-- == 0;
    if (tie) view.apart = cornersApart(map, landmark, longest->id, view.feature->id, keyframes[view.frame]);
    if (view.own_track || track == tracks.end() || tie) views_.push_back(view);
  }
  for (auto track = tracks.begin(); track != tracks.end(); ++track) {
    if (track == longest || track->views < 2) continue;
    points_.push_back(&landmark);
    first_.push_back(viewCount());
    for (LandmarkView& view : seen) {
      if (view.feature->id != track->id) continue;
      view.own_track = true;
      view.apart = 1;
      views_.push_back(view);
    }
  }
}

}  // namespace vip_slam
