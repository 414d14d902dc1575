// SPDX-License-Identifier: BSD-3-Clause
// Updates the plane map with a placed keyframe: grow, start, observe, associate.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plane_mapper_impl.h"
#include "vip_slam_planes/detection/plane_detector.h"
#include "vip_slam_planes/growth/contradiction.h"
#include "vip_slam_planes/growth/other_layers.h"
#include "vip_slam_planes/growth/see_through.h"
#include "vip_slam_planes/growth/triangle_association.h"
#include "vip_slam_planes/merging/plane_merging.h"

namespace vip_slam {
namespace {

constexpr int kEstablished = 3;  // a plane seen by this many keyframes is removed only after two contradictions

}  // namespace

void PlaneMapper::Impl::processKeyframe(const Keyframe& keyframe, bool first_time) {
  const ScopedTimer timer(timing, "planes.keyframe", keyframe.frame.t);
  const SE3& T_map_C = keyframes_.poses().at(keyframe.id);
  const DepthGrid& grid = keyframe.frame.depth_grid;
  const DepthMesh& mesh =
      mesher_.build(keyframe.frame.features, grid, T_map_C.R().row(2), keyframe.frame.camera_correction.bearing);
  const std::vector<MapTriangle> triangles = placeMesh(mesh, T_map_C);
  if (first_time) removeContradicted(triangles, T_map_C, keyframe.frame.epoch);
  std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, keyframe.frame.epoch);
  std::vector<int> label = associateTriangles(triangles, {tracks.begin(), tracks.end()}, options.growth);
  const std::vector<PlaneId> beside = releaseOtherLayers(triangles, {tracks.begin(), tracks.end()}, &label);

  std::vector<CellIndex> seen_again;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    seen_again.clear();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (label[i] != static_cast<int>(k)) continue;
      // Triangles accepted only because of their noise cover cells without adding hits, so that a nearer view can clear
      // them at once.
      const bool sure = distanceGate(triangles[i], options.growth.distance) <= options.growth.distance;
      tracks[k]->cover(triangles[i], keyframe.id, T_map_C, sure ? &seen_again : nullptr);
    }
    if (!first_time) continue;
    for (const CellIndex& c : seen_again) tracks[k]->hit(c);
  }
  const std::size_t known = tracks.size();
  if (first_time) {
    std::vector<DetectedPlane> strips = startPlanes(keyframe, T_map_C, triangles, &label, &tracks);
    const CameraPoses& poses = keyframes_.posesTiedTo(keyframe.frame.epoch);
    for (const auto& [track, e] : evidence_.takeJoining(poses, {tracks.begin(), tracks.end()})) {
      tracks_.at(track->id()).cover(e.triangle, e.keyframe, poses.at(e.keyframe), nullptr);
    }
    evidence_.add(keyframe.id, T_map_C, triangles, label, beside);
    startJointPlanes(keyframe, evidence_.detect(poses, {tracks.begin(), tracks.end()}), &label, &tracks);
    const auto known_by_now = [&](const DetectedPlane& strip) {
      return std::any_of(strip.triangles.begin(), strip.triangles.end(), [&](int i) { return label[i] >= 0; });
    };
    strips.erase(std::remove_if(strips.begin(), strips.end(), known_by_now), strips.end());
    strips_.add(keyframe.id, T_map_C, triangles, label, strips);
    startJointPlanes(keyframe, strips_.detect(keyframes_.posesTiedTo(keyframe.frame.epoch)), &label, &tracks);
    ++counters.keyframes;
  }
  const SurfaceLabels labels = labelNodes(mesh, label, grid);
  for (std::size_t k = 0; first_time && k < known; ++k) {
    clearRefuted(grid, labels, static_cast<int>(k), *camera, noise, T_map_C, options.support.see_through, tracks[k]);
  }
  observe(keyframe, T_map_C, tracks, label, labels, mesh, first_time);
  if (first_time) {
    for (PlaneTrack* track : tracks) {
      if (!track->confirmed && showsIn(*track, *camera, noise, T_map_C)) ++track->keyframes_waited;
    }
  }
}

// Called before the triangles are associated: they then join the remaining planes or start new ones. A plane that
// several keyframes have seen is not removed because of a single one.
void PlaneMapper::Impl::removeContradicted(const std::vector<MapTriangle>& triangles, const SE3& T_map_C,
                                           std::uint32_t epoch) {
  const std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, epoch);
  const std::vector<const PlaneTrack*> all(tracks.begin(), tracks.end());
  std::vector<PlaneId> contradicted;
  for (PlaneTrack* track : tracks) {
    const PlaneVerdict verdict = planeVerdict(triangles, *track, all, options.detection, options.growth);
    if (verdict == PlaneVerdict::kFor) track->contradictions = 0;
    if (verdict != PlaneVerdict::kAgainst) continue;
    ++track->contradictions;
    if (track->keyframes_seen < kEstablished || track->contradictions > 1) contradicted.push_back(track->id());
  }
  for (PlaneId id : contradicted) removePlane(id);
}

PlaneTrack& PlaneMapper::Impl::startPlane(PlaneKind kind, const Plane& plane, const Eigen::Vector3d& centroid,
                                          std::uint32_t epoch) {
  const PlaneId id = next_plane_++;
  PlaneTrack& track = tracks_.try_emplace(id, id, kind, plane, centroid, options.growth.cell).first->second;
  track.epoch = epoch;
  ++counters.planes_started;
  return track;
}

std::vector<DetectedPlane> PlaneMapper::Impl::startPlanes(const Keyframe& keyframe, const SE3& T_map_C,
                                                          const std::vector<MapTriangle>& triangles,
                                                          std::vector<int>* label, std::vector<PlaneTrack*>* tracks) {
  std::vector<char> taken(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) taken[i] = (*label)[i] >= 0;
  std::vector<DetectedPlane> strips;
  for (const DetectedPlane& found :
       detectPlanes(triangles, taken, T_map_C.t(), options.detection, options.growth, &strips)) {
    PlaneTrack& track = startPlane(found.kind, found.plane, found.centroid, keyframe.frame.epoch);
    for (int i : found.triangles) {
      track.cover(triangles[i], keyframe.id, T_map_C, nullptr);
      (*label)[i] = static_cast<int>(tracks->size());
    }
    if (track.area() < options.support.sure_area) {
      track.keyframes_seen =
          evidence_.seenBy(track, keyframes_.posesTiedTo(keyframe.frame.epoch), options.support.min_area);
    }
    tracks->push_back(&track);
  }
  return strips;
}

void PlaneMapper::Impl::startJointPlanes(const Keyframe& keyframe, const std::vector<JointPlane>& joint,
                                         std::vector<int>* label, std::vector<PlaneTrack*>* tracks) {
  for (const JointPlane& found : joint) {
    PlaneTrack& track = startPlane(found.kind, found.plane, found.centroid, keyframe.frame.epoch);
    std::set<KeyframeId> earlier;
    for (const EvidenceTriangle& e : found.triangles) {
      track.cover(e.triangle, e.keyframe, keyframes_.poses().at(e.keyframe), nullptr);
      if (e.keyframe == keyframe.id) {
        (*label)[e.index] = static_cast<int>(tracks->size());
      } else {
        earlier.insert(e.keyframe);
      }
    }
    track.keyframes_seen = static_cast<int>(earlier.size());
    tracks->push_back(&track);
  }
}

void PlaneMapper::Impl::observe(const Keyframe& keyframe, const SE3& T_map_C, const std::vector<PlaneTrack*>& tracks,
                                const std::vector<int>& label, const SurfaceLabels& labels, const DepthMesh& mesh,
                                bool first_time) {
  std::vector<double> area(tracks.size(), 0);
  for (std::size_t i = 0; i < label.size(); ++i) {
    if (label[i] >= 0) area[label[i]] += mesh.triangles[i].area;
  }
  const std::vector<Eigen::Vector2f>& rays = rays_(keyframe.frame.depth_grid, keyframe.frame.camera_correction.bearing);
  const auto shown = pointsByLabel(keyframe, labels, rays, tracks.size());
  std::vector<PlaneId> ids;
  std::vector<char> trusted;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    PlaneTrack& track = *tracks[k];
    ids.push_back(track.id());
    if (area[k] > 0) {
      auto observation = sampler_.sample(keyframe.id, shown[k], T_map_C, track.id(), track.plane());
      if (observation) {
        observation->camera_correction = keyframe.frame.camera_correction;
        track.observations().insert_or_assign(keyframe.id, std::move(*observation));
        changes_.observed(track.id(), keyframe.id);
        refit(&track);
      }
    }
    if (first_time && area[k] >= options.support.min_area) {
      ++track.keyframes_seen;
      track.viewed_from = T_map_C.t();
    }
    const double covered = track.area();
    const bool seen = track.keyframes_seen >= options.support.min_keyframes && covered >= options.support.min_area;
    const bool large = track.keyframes_seen > 0 && covered >= options.support.sure_area;
    track.confirmed = track.confirmed || seen || large;
    trusted.push_back(track.known() && track.determined && track.agrees);
  }
  points_.process(keyframe, labels, ids, trusted, keyframes_.poses(), [this](PlaneId id) { return findPlane(id); });
}

// A piece of a wall seen from afar may pass for the door in it as well: it goes to the one that it suits best.
PlaneId PlaneMapper::Impl::samePlane(PlaneId id) {
  const PlaneTrack& mine = tracks_.at(id);
  const SceneView view{keyframes_.placed(),         keyframes_.poses(), *camera, noise,
                       options.support.see_through, open_gaps_};
  PlaneId best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [other_id, other] : tracks_) {
    if (other_id == id || !keyframes_.tied(mine.epoch, other.epoch)) continue;
    if (other.seenSince(keyframes_.sureSince()) != mine.seenSince(keyframes_.sureSince())) continue;
    if (!sameSurface(mine, other, view, options.merging)) continue;
    const double misfit = jointMisfit(mine, other, keyframes_.poses());
    if (best == 0 || misfit < least) best = other_id, least = misfit;
  }
  return best;
}

void PlaneMapper::Impl::mergePlanes(const std::vector<PlaneId>& changed) {
  // Each merge may make further merges possible; each removes a plane, so this terminates.
  std::set<PlaneId> open(changed.begin(), changed.end());
  while (!open.empty()) {
    const PlaneId id = *open.begin();
    open.erase(open.begin());
    PlaneId one = id, other = tracks_.count(id) ? samePlane(id) : 0;
    if (other == 0) continue;
    // On to the plane that suits each better, until two suit each other best; bounded, whatever the misfits are.
    for (std::size_t steps = 0; steps < tracks_.size(); ++steps) {
      const PlaneId better = samePlane(other);
      if (better == one || better == 0) break;
      one = other, other = better;
    }
    if (one != id && other != id) open.insert(id);
    // The older id is kept, unless only the newer one is known to the back end.
    PlaneId into = std::min(one, other), from = std::max(one, other);
    if (tracks_.at(from).known() && !tracks_.at(into).known()) std::swap(into, from);
    mergeInto(from, into);
    open.erase(from);
    open.insert(into);
  }
}

void PlaneMapper::Impl::mergeInto(PlaneId from_id, PlaneId into_id) {
  PlaneTrack& into = tracks_.at(into_id);
  const PlaneTrack& from = tracks_.at(from_id);
  changes_.merged(from, into);
  into.absorb(from, keyframes_.poses());
  refit(&into);
  points_.renamePlane(from_id, into_id);
  open_gaps_.rename(from_id, into_id);
  into.takes_points = false;  // so that candidates of the other plane are decided on as well
  tracks_.erase(from_id);
  ++counters.planes_merged;
}

void PlaneMapper::Impl::removePlane(PlaneId id) {
  const auto it = tracks_.find(id);
  if (it == tracks_.end()) return;
  changes_.removed(it->second);
  counters.planes_removed += it->second.known();
  points_.removePlane(id);
  open_gaps_.remove(id);
  tracks_.erase(it);
}

const Plane* PlaneMapper::Impl::findPlane(PlaneId id) const {
  const auto it = tracks_.find(id);
  return it == tracks_.end() ? nullptr : &it->second.plane();
}

}  // namespace vip_slam
