// SPDX-License-Identifier: BSD-3-Clause
// Landmarks of the map: observations, merging, descriptors.
#include <algorithm>
#include <limits>
#include <unordered_set>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

MapLandmark& Map::addLandmark(LandmarkId id, const Eigen::Vector3d& p_W, const MapObservation& first) {
  const std::string name = "landmark " + std::to_string(id);
  if (id == kNoLandmark) throw MapError("a landmark needs an id");
  if (hasLandmark(id) || aliases_.isAlias(id)) throw MapError(name + " exists already");
  if (!p_W.allFinite()) throw MapError(name + ": position is not finite");
  MapKeyframe& kf = keyframe(first.keyframe);
  if (first.feature >= kf.landmarks.size()) throw MapError(name + ": no such feature in its keyframe");
  if (kf.landmarks[first.feature] != kNoLandmark) throw MapError(name + ": its feature has a landmark already");
  MapLandmark landmark;
  landmark.id = id;
  landmark.p_W = p_W;
  landmark.observations.push_back(first);
  landmark.descriptor = kf.features()[first.feature].descriptor;
  landmark.visible = landmark.found = 1;
  kf.landmarks[first.feature] = id;
  return landmarks_.emplace(id, std::move(landmark)).first->second;
}

MapLandmark& Map::restoreLandmark(const MapLandmark& stored) {
  const std::string name = "landmark " + std::to_string(stored.id);
  if (stored.id == kNoLandmark) throw MapError("a landmark needs an id");
  if (hasLandmark(stored.id) || aliases_.isAlias(stored.id)) throw MapError(name + " exists already");
  if (!stored.p_W.allFinite()) throw MapError(name + ": position is not finite");
  if (stored.plane != 0 && !hasPlane(stored.plane)) throw MapError(name + ": lies on a plane that is not in the map");
  if (stored.observations.empty()) throw MapError(name + ": no observation");
  KeyframeId last = 0;
  for (const MapObservation& o : stored.observations) {
    if (o.keyframe <= last) throw MapError(name + ": observations are not ascending, one per keyframe");
    last = o.keyframe;
    const MapKeyframe& kf = keyframe(o.keyframe);
    if (o.feature >= kf.landmarks.size() || kf.landmarks[o.feature] != kNoLandmark)
      throw MapError(name + ": its feature in keyframe " + std::to_string(o.keyframe) + " is unknown or taken");
  }
  for (const MapObservation& o : stored.observations) keyframe(o.keyframe).landmarks[o.feature] = stored.id;
  return landmarks_.emplace(stored.id, stored).first->second;
}

bool Map::addObservation(LandmarkId id, const MapObservation& observation) {
  MapLandmark& l = landmark(id);
  MapKeyframe& kf = keyframe(observation.keyframe);
  if (observation.feature >= kf.landmarks.size())
    throw MapError("landmark " + std::to_string(id) + ": no such feature in its keyframe");
  if (kf.landmarks[observation.feature] != kNoLandmark) return false;
  const auto at = std::lower_bound(l.observations.begin(), l.observations.end(), observation.keyframe,
                                   [](const MapObservation& o, KeyframeId k) { return o.keyframe < k; });
  if (at != l.observations.end() && at->keyframe == observation.keyframe) return false;
  l.observations.insert(at, observation);
  kf.landmarks[observation.feature] = id;
  updateDescriptor(l);
  return true;
}

void Map::removeObservation(LandmarkId id, KeyframeId keyframe_id) {
  MapLandmark& l = landmark(id);
  const auto at = std::find_if(l.observations.begin(), l.observations.end(),
                               [&](const MapObservation& o) { return o.keyframe == keyframe_id; });
  if (at == l.observations.end()) return;
  keyframe(keyframe_id).landmarks[at->feature] = kNoLandmark;
  l.observations.erase(at);
  if (l.observations.empty()) {
    landmarks_.erase(id);
    changes_.removed_landmarks.push_back(id);
  }
}

void Map::removeLandmark(LandmarkId id) {
  for (const MapObservation& o : landmark(id).observations) keyframe(o.keyframe).landmarks[o.feature] = kNoLandmark;
  landmarks_.erase(id);
  changes_.removed_landmarks.push_back(id);
}

bool Map::mergeLandmarks(LandmarkId from, LandmarkId into) {
  if (from == into) return false;
  MapLandmark& a = landmark(from);
  MapLandmark& b = landmark(into);
  for (const MapObservation& o : a.observations)
    for (const MapObservation& p : b.observations)
      if (o.keyframe == p.keyframe) return false;
  for (const MapObservation& o : a.observations) {
    keyframe(o.keyframe).landmarks[o.feature] = into;
    b.observations.push_back(o);
  }
  std::sort(b.observations.begin(), b.observations.end(),
            [](const MapObservation& x, const MapObservation& y) { return x.keyframe < y.keyframe; });
  b.visible += a.visible;
  b.found += a.found;
  if (b.plane == 0) b.plane = a.plane;
  landmarks_.erase(from);
  aliases_.merge(from, into);
  changes_.merged_landmarks.emplace_back(from, into);
  updateDescriptor(b);
  return true;
}

void Map::forgetAliases() {
  std::unordered_set<LandmarkId> in_use;
  for (const auto& entry : keyframes_)
    for (const Feature& f : entry.second.data->frame.features) in_use.insert(f.id);
  aliases_.forgetUnused(in_use);
}

MapLandmark& Map::landmark(LandmarkId id) {
  const auto it = landmarks_.find(id);
  if (it == landmarks_.end()) throw MapError("no landmark " + std::to_string(id) + " in the map");
  return it->second;
}

const MapLandmark& Map::landmark(LandmarkId id) const { return const_cast<Map*>(this)->landmark(id); }

const MapLandmark* Map::findLandmark(LandmarkId id) const {
  const auto it = landmarks_.find(id);
  return it == landmarks_.end() ? nullptr : &it->second;
}

std::vector<LandmarkId> Map::landmarkIds() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& entry : landmarks_) ids.push_back(entry.first);
  std::sort(ids.begin(), ids.end());
  return ids;
}

void Map::setPosition(LandmarkId id, const Eigen::Vector3d& p_W) {
  if (!p_W.allFinite()) throw MapError("landmark " + std::to_string(id) + ": new position is not finite");
  landmark(id).p_W = p_W;
}

void Map::updateDescriptor(MapLandmark& landmark) {
  // The medoid of the newest few: old views of a long track differ from the present appearance.
  constexpr std::size_t kNewest = 8;
  const std::size_t n = landmark.observations.size(), begin = n > kNewest ? n - kNewest : 0;
  int best_sum = std::numeric_limits<int>::max();
  for (std::size_t i = begin; i < n; ++i) {
    const Descriptor& candidate = feature(landmark.observations[i]).descriptor;
    int sum = 0;
    for (std::size_t j = begin; j < n; ++j)
      sum += hammingDistance(candidate, feature(landmark.observations[j]).descriptor);
    if (sum < best_sum) {
      best_sum = sum;
      landmark.descriptor = candidate;
    }
  }
}

}  // namespace vip_slam
