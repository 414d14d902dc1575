// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/association/point_association.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "vip_slam_planes/association/consistency_test.h"

namespace vip_slam {

void PointAssociation::assign(LandmarkId id, Landmark* landmark, PlaneId candidate, PlaneId plane) {
  undecided_ -= undecided(*landmark);
  for (PlaneId old : {landmark->candidate, landmark->plane}) {
    const auto it = old && old != candidate && old != plane ? on_plane_.find(old) : on_plane_.end();
    if (it == on_plane_.end()) continue;
    it->second.erase(id);
    if (it->second.empty()) on_plane_.erase(it);
  }
  for (PlaneId fresh : {candidate, plane}) {
    if (fresh) on_plane_[fresh].insert(id);
  }
  landmark->candidate = candidate;
  landmark->plane = plane;
  undecided_ += undecided(*landmark);
}

void PointAssociation::erase(Landmarks::iterator it) {
  assign(it->first, &it->second, 0, 0);
  landmarks_.erase(it);
}

std::vector<LandmarkId> PointAssociation::landmarksOf(PlaneId plane) const {
  const auto it = on_plane_.find(plane);
  if (it == on_plane_.end()) return {};
  return {it->second.begin(), it->second.end()};
}

void PointAssociation::setPlane(LandmarkId id, Landmark* landmark, PlaneId plane) {
  if (landmark->plane == plane) return;
  assign(id, landmark, landmark->candidate, plane);
  if (plane) {
    associated_.emplace_back(id, plane);
  } else {
    dissociated_.push_back(id);
  }
}

void PointAssociation::applyMapUpdate(const MapUpdate& update) {
  for (const auto& [from, into] : update.merged_landmarks) {
    const LandmarkId target = aliases_.resolve(into), source = aliases_.resolve(from);
    if (source == target) continue;
    aliases_.merge(source, target);
    const auto it = landmarks_.find(source);
    if (it == landmarks_.end()) continue;
    const Landmark moved = it->second;
    erase(it);
    Landmark& kept = landmarks_[target];
    for (const Sighting& s : moved.sightings) {
      const bool known = std::any_of(kept.sightings.begin(), kept.sightings.end(),
                                     [&](const Sighting& o) { return o.keyframe == s.keyframe; });
      if (!known) kept.sightings.push_back(s);
    }
    if (!kept.candidate) assign(target, &kept, moved.candidate, kept.plane);
    if (!kept.placed) kept.p_W = moved.p_W, kept.placed = moved.placed;
    // The back end gave the merged landmark a plane by its own rule; reporting ours keeps both consistent.
    if (!kept.plane && moved.plane) setPlane(target, &kept, moved.plane);
  }
  for (LandmarkId id : update.removed_landmarks) {
    const auto it = landmarks_.find(aliases_.resolve(id));
    if (it != landmarks_.end()) erase(it);
  }
  for (const LandmarkEstimate& estimate : update.landmarks) {
    if (!estimate.p_W.allFinite()) continue;
    Landmark& landmark = landmarks_[aliases_.resolve(estimate.id)];
    landmark.p_W = estimate.p_W;
    landmark.placed = true;
  }
}

void PointAssociation::addSightings(const Keyframe& keyframe) {
  const std::vector<Feature>& features = keyframe.frame.features;
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    if (f.id == kNoLandmark) continue;
    landmarks_[aliases_.resolve(f.id)].sightings.push_back(
        {keyframe.id, i, f.xy, f.depth, f.depth_sigma, f.pixel_sigma});
  }
}

void PointAssociation::renewSightings(const Keyframe& keyframe) {
  const std::vector<Feature>& features = keyframe.frame.features;
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    const auto it = f.id == kNoLandmark ? landmarks_.end() : landmarks_.find(aliases_.resolve(f.id));
    if (it == landmarks_.end()) continue;
    for (Sighting& s : it->second.sightings) {
      if (s.keyframe == keyframe.id && s.feature == i) s.xy = f.xy, s.depth = f.depth;
    }
  }
}

void PointAssociation::removeKeyframe(const Keyframe& keyframe) {
  for (const Feature& f : keyframe.frame.features) {
    const auto it = f.id == kNoLandmark ? landmarks_.end() : landmarks_.find(aliases_.resolve(f.id));
    if (it == landmarks_.end()) continue;
    std::vector<Sighting>& s = it->second.sightings;
    s.erase(std::remove_if(s.begin(), s.end(), [&](const Sighting& o) { return o.keyframe == keyframe.id; }), s.end());
    if (s.empty() && !it->second.placed) erase(it);
  }
}

bool PointAssociation::isDue(const Landmark& landmark) const {
  // Associated points are tested again when their number of sightings has doubled, and then at each sighting until they
  // pass or are given up.
  const bool settled = landmark.plane && landmark.failures == 0;
  const std::size_t due = settled ? 2 * landmark.tested : landmark.tested + 1;
  return landmark.sightings.size() >= std::max<std::size_t>(options_.min_keyframes, due);
}

void PointAssociation::test(LandmarkId id, Landmark* landmark, const CameraPoses& poses, const Plane& plane) {
  std::vector<PointSighting> sightings;
  for (const Sighting& s : landmark->sightings) {
    const auto pose = poses.find(s.keyframe);
    if (pose == poses.end()) continue;
    sightings.push_back({pose->second.inverse(), s.xy.cast<double>(), double(s.depth),
                         std::hypot(double(s.depth_sigma), depth_floor_), double(s.pixel_sigma)});
  }
  if (sightings.size() < std::size_t(options_.min_keyframes)) return;
  landmark->tested = landmark->sightings.size();
  const ConsistencyResult result = testConsistency(sightings, plane, landmark->p_W, focal_, options_);
  if (result.consistent) {
    landmark->failures = 0;
    setPlane(id, landmark, landmark->candidate);
    return;
  }
  if (++landmark->failures < options_.max_failures) return;
  landmark->refused.push_back(landmark->candidate);
  assign(id, landmark, 0, landmark->plane);
  landmark->failures = 0;
  setPlane(id, landmark, 0);
}

PlaneId PointAssociation::chooseCandidate(const Feature& f, const Landmark& landmark, const SurfaceLabels& labels,
                                          const std::vector<PlaneId>& plane_of_label, const SE3& T_map_C,
                                          const FindPlane& find_plane) const {
  const std::vector<SurfaceLabels::Node> nodes = labels.nodesAround(f.pixel);
  if (nodes.size() < 2) return 0;
  // At a concave edge, where floor and wall meet, either plane is possible: the nearer one first, and the other one
  // when the test refuses it. Points on a convex edge belong to an occluding outline, which moves with the view.
  const Eigen::Matrix3d R = T_map_C.R();
  const auto range = [&](const Plane& plane, const Eigen::Vector3d& ray) {
    const double facing = plane.n.dot(ray);
    return facing < 0 ? -plane.signedDistance(T_map_C.t()) / facing : std::numeric_limits<double>::infinity();
  };
  double nearest = options_.candidate_distance;
  PlaneId best = 0;
  for (const SurfaceLabels::Node& node : nodes) {
    const Plane* own = find_plane(plane_of_label[node.label]);
    if (!own) return 0;
    const Eigen::Vector2f xy = f.xy + (node.pixel - f.pixel) / float(focal_);
    const Eigen::Vector3d ray = R * Eigen::Vector3d(xy.x(), xy.y(), 1.0);
    for (const SurfaceLabels::Node& other : nodes) {
      if (other.label == node.label) continue;
      const Plane* plane = find_plane(plane_of_label[other.label]);
      if (!plane || range(*own, ray) > range(*plane, ray)) return 0;
    }
    const PlaneId id = plane_of_label[node.label];
    const double distance = std::abs(own->signedDistance(landmark.p_W));
    if (distance >= nearest || std::count(landmark.refused.begin(), landmark.refused.end(), id) > 0) continue;
    nearest = distance;
    best = id;
  }
  return best;
}

void PointAssociation::process(const Keyframe& keyframe, const SurfaceLabels& labels,
                               const std::vector<PlaneId>& plane_of_label, const std::vector<char>& trusted,
                               const CameraPoses& poses, const FindPlane& find_plane) {
  const auto pose = poses.find(keyframe.id);
  if (pose == poses.end()) return;
  for (const Feature& f : keyframe.frame.features) {
    if (f.id == kNoLandmark) continue;
    const LandmarkId id = aliases_.resolve(f.id);
    const auto it = landmarks_.find(id);
    if (it == landmarks_.end()) continue;
    Landmark& landmark = it->second;
    if (!landmark.placed) {
      if (!(f.depth > 0)) continue;
      landmark.p_W = pose->second * (Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0) * f.depth);
    }
    if (!landmark.candidate) {
      const PlaneId chosen = chooseCandidate(f, landmark, labels, plane_of_label, pose->second, find_plane);
      assign(id, &landmark, chosen, landmark.plane);
      landmark.failures = 0;
    }
    if (!landmark.candidate) continue;
    if (!isDue(landmark)) continue;
    const auto label = std::find(plane_of_label.begin(), plane_of_label.end(), landmark.candidate);
    if (label != plane_of_label.end() && !trusted[label - plane_of_label.begin()]) continue;
    const Plane* plane = find_plane(landmark.candidate);
    if (plane) test(id, &landmark, poses, *plane);
  }
}

void PointAssociation::decide(PlaneId id, const Plane& plane, const CameraPoses& poses) {
  for (LandmarkId point : landmarksOf(id)) {
    Landmark& landmark = landmarks_.at(point);
    if (landmark.candidate == id && landmark.plane != id && isDue(landmark)) test(point, &landmark, poses, plane);
  }
}

void PointAssociation::recheck(const FindPlane& find_plane) {
  for (auto& [id, landmark] : landmarks_) {
    landmark.refused.clear();  // the map has moved: refused planes may be tested again
    if (!landmark.plane || !landmark.placed) continue;
    const Plane* plane = find_plane(landmark.plane);
    if (plane && std::abs(plane->signedDistance(landmark.p_W)) < options_.candidate_distance) continue;
    assign(id, &landmark, 0, landmark.plane);
    landmark.tested = 0;
    setPlane(id, &landmark, 0);
  }
}

void PointAssociation::renamePlane(PlaneId from, PlaneId into) {
  for (LandmarkId id : landmarksOf(from)) {
    Landmark& landmark = landmarks_.at(id);
    const auto renamed = [from, into](PlaneId plane) { return plane == from ? into : plane; };
    assign(id, &landmark, renamed(landmark.candidate), renamed(landmark.plane));  // not reported: the merge implies it
  }
}

void PointAssociation::removePlane(PlaneId plane) {
  for (LandmarkId id : landmarksOf(plane)) {
    Landmark& landmark = landmarks_.at(id);
    if (landmark.candidate == plane) assign(id, &landmark, 0, landmark.plane), landmark.tested = 0;
    if (landmark.plane == plane) setPlane(id, &landmark, 0);
  }
}

void PointAssociation::releaseFrom(PlaneId plane) {
  for (LandmarkId id : landmarksOf(plane)) {
    Landmark& landmark = landmarks_.at(id);
    if (landmark.plane != plane) continue;
    setPlane(id, &landmark, 0);
    landmark.tested = 0;
  }
}

void PointAssociation::clear() {
  landmarks_.clear();
  on_plane_.clear();
  undecided_ = 0;
  aliases_.clear();
  associated_.clear();
  dissociated_.clear();
}

std::vector<std::pair<LandmarkId, PlaneId>> PointAssociation::takeAssociated() {
  // The final state per landmark, ordered by id, so that the output does not depend on the hash table.
  std::set<LandmarkId> ids;
  for (const auto& [id, plane] : associated_) ids.insert(aliases_.resolve(id));
  std::vector<std::pair<LandmarkId, PlaneId>> result;
  for (LandmarkId id : ids) {
    const PlaneId plane = planeOf(id);
    if (plane) result.emplace_back(id, plane);
  }
  associated_.clear();
  return result;
}

std::vector<LandmarkId> PointAssociation::takeDissociated() {
  std::set<LandmarkId> ids;
  for (LandmarkId id : dissociated_) {
    if (landmarks_.count(id) && !planeOf(id)) ids.insert(id);
  }
  dissociated_.clear();
  return {ids.begin(), ids.end()};
}

PlaneId PointAssociation::planeOf(LandmarkId id) const {
  const auto it = landmarks_.find(aliases_.resolve(id));
  return it == landmarks_.end() ? 0 : it->second.plane;
}

}  // namespace vip_slam
