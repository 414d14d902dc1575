// SPDX-License-Identifier: BSD-3-Clause
// What images add to the planes. A tracked frame: grow. A placed keyframe: grow, start, observe, associate.
#include <set>
#include <utility>
#include <vector>

#include "plane_mapper_impl.h"
#include "state/fit_to_observations.h"
#include "vip_slam_core/types/camera_correction.h"
#include "vip_slam_planes/detection/plane_detector.h"
#include "vip_slam_planes/growth/contradiction.h"
#include "vip_slam_planes/growth/other_layers.h"
#include "vip_slam_planes/growth/see_through.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

bool isSound(const CameraCorrection& correction) { return validateCameraCorrection(correction).empty(); }

bool isSound(const DepthGrid& grid) {
  if (grid.cols < 0 || grid.rows < 0 || grid.z.size() != std::size_t(grid.cols) * std::size_t(grid.rows)) return false;
  return grid.empty() || grid.stride > 0;
}

}  // namespace

void PlaneMapper::Impl::addKeyframe(const KeyframePtr& keyframe) {
  // A keyframe that was in transit when the map was loaded has the id of a stored one, which it would replace.
  if (!keyframe || keyframes_.known(keyframe->id)) return;
  if (!isSound(keyframe->frame.depth_grid) || !isSound(keyframe->frame.camera_correction)) return;
  counters_.keyframes_forgotten += keyframes_.wait(keyframe);
}

std::vector<PlaneTrack*> PlaneMapper::Impl::tracksInView(const SE3& T_map_C, std::uint32_t epoch) {
  return planes_.inView(T_map_C, epoch, noise_.max_range, keyframes_);
}

void PlaneMapper::Impl::grow(const TrackedFrame& frame, const SE3& T_map_odom) {
  const bool usable = frame.status.state == TrackingState::kTracking && !frame.depth_grid.empty() &&
                      keyframes_.newest() != 0 && frame.epoch == keyframes_.newestEpoch() && !mode_.localising() &&
                      !planes_.empty() && isSound(frame.depth_grid) && isSound(frame.camera_correction);
  const SE3 T_map_C = T_map_odom * frame.state.T_W_I * frame.T_I_C;
  if (!usable || !T_map_C.isFinite() || !pace_.due(T_map_C, options_.growth)) {
    ++counters_.frames_skipped;
    return;
  }
  const ScopedTimer timer(timing_, "planes.grow", frame.t);
  ++counters_.frames_grown;
  pace_.grew(T_map_C);
  const std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, frame.epoch);
  if (tracks.empty()) return;
  const DepthMesh& mesh =
      mesher_.build(frame.features, frame.depth_grid, T_map_C.R().row(2), frame.camera_correction.bearing);
  const std::vector<MapTriangle> triangles = placeMesh(mesh, T_map_C);
  std::vector<int> label = associateTriangles(triangles, {tracks.begin(), tracks.end()}, options_.growth);
  releaseOtherLayers(triangles, {tracks.begin(), tracks.end()}, options_.detection.max_rms, &label);
  const CameraPoses& poses = keyframes_.poses();
  const KeyframeId host = poses.count(frame.keyframe) ? frame.keyframe : keyframes_.newest();
  std::vector<double> area(tracks.size(), 0);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (label[i] < 0) continue;
    tracks[label[i]]->cover(triangles[i], host, poses.at(host), nullptr);
    area[label[i]] += triangles[i].area;
  }
  // Frames from other places confirm a plane that one keyframe has started, as a second keyframe would.
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    PlaneTrack& track = *tracks[k];
    if (track.confirmed || track.keyframes_seen == 0 || area[k] < options_.support.min_area) continue;
    if ((T_map_C.t() - track.viewed_from).norm() < options_.support.view_distance) continue;
    track.viewed_from = T_map_C.t();
    track.confirmed = ++track.views_seen >= options_.support.min_views;
  }
}

void PlaneMapper::Impl::processKeyframe(const Keyframe& keyframe, bool first_time) {
  const ScopedTimer timer(timing_, "planes.keyframe", keyframe.frame.t);
  const SE3& T_map_C = keyframes_.poses().at(keyframe.id);
  const DepthGrid& grid = keyframe.frame.depth_grid;
  const DepthMesh& mesh =
      mesher_.build(keyframe.frame.features, grid, T_map_C.R().row(2), keyframe.frame.camera_correction.bearing);
  const std::vector<MapTriangle> triangles = placeMesh(mesh, T_map_C);
  if (first_time) removeContradicted(triangles, T_map_C, keyframe.frame.epoch);
  std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, keyframe.frame.epoch);
  std::vector<int> label = associateTriangles(triangles, {tracks.begin(), tracks.end()}, options_.growth);
  const std::vector<PlaneId> beside =
      releaseOtherLayers(triangles, {tracks.begin(), tracks.end()}, options_.detection.max_rms, &label);

  std::vector<CellIndex> seen_again;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    seen_again.clear();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (label[i] != static_cast<int>(k)) continue;
      // Triangles accepted only because of their noise cover cells without adding hits, so that a nearer view can clear
      // them at once.
      const bool sure = distanceGate(triangles[i], options_.growth.distance) <= options_.growth.distance;
      tracks[k]->cover(triangles[i], keyframe.id, T_map_C, sure ? &seen_again : nullptr);
    }
    if (!first_time) continue;
    for (const CellIndex& c : seen_again) tracks[k]->hit(c);
  }
  const std::size_t known = tracks.size();
  if (first_time) {
    startPlanes(keyframe, T_map_C, triangles, &label, &tracks);
    const CameraPoses& poses = keyframes_.posesTiedTo(keyframe.frame.epoch);
    for (const auto& [track, e] : evidence_.takeJoining(poses, {tracks.begin(), tracks.end()})) {
      planes_.at(track->id()).cover(e.triangle, e.keyframe, poses.at(e.keyframe), nullptr);
    }
    evidence_.add(keyframe.id, T_map_C, triangles, label, beside);
    startJointPlanes(keyframe, evidence_.detect(poses, {tracks.begin(), tracks.end()}), &label, &tracks);
    ++counters_.keyframes;
  }
  const SurfaceLabels labels = labelNodes(mesh, label, grid);
  for (std::size_t k = 0; first_time && k < known; ++k) {
    clearRefuted(grid, labels, static_cast<int>(k), *camera_, noise_, T_map_C, options_.support.see_through, tracks[k]);
  }
  observe(keyframe, T_map_C, tracks, label, labels, mesh, first_time);
  if (first_time) {
    for (PlaneTrack* track : tracks) {
      if (!track->confirmed && showsIn(*track, *camera_, noise_, T_map_C)) ++track->keyframes_waited;
    }
  }
}

// Called before the triangles are associated: they then join the remaining planes or start new ones. A plane that
// more keyframes have seen than it needs is removed only when two in a row contradict it.
void PlaneMapper::Impl::removeContradicted(const std::vector<MapTriangle>& triangles, const SE3& T_map_C,
                                           std::uint32_t epoch) {
  const std::vector<PlaneTrack*> tracks = tracksInView(T_map_C, epoch);
  const std::vector<const PlaneTrack*> all(tracks.begin(), tracks.end());
  std::vector<PlaneId> contradicted;
  for (PlaneTrack* track : tracks) {
    const PlaneVerdict verdict = planeVerdict(triangles, *track, all, options_.detection, options_.growth);
    if (verdict == PlaneVerdict::kFor) track->contradictions = 0;
    if (verdict != PlaneVerdict::kAgainst) continue;
    ++track->contradictions;
    if (track->keyframes_seen <= options_.support.min_keyframes || track->contradictions > 1)
      contradicted.push_back(track->id());
  }
  for (PlaneId id : contradicted) {
    planes_.remove(id);
    points_.removePlane(id);
  }
}

void PlaneMapper::Impl::startPlanes(const Keyframe& keyframe, const SE3& T_map_C,
                                    const std::vector<MapTriangle>& triangles, std::vector<int>* label,
                                    std::vector<PlaneTrack*>* tracks) {
  std::vector<char> taken(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) taken[i] = (*label)[i] >= 0;
  for (const DetectedPlane& found : detectPlanes(triangles, taken, T_map_C.t(), options_.detection, options_.growth)) {
    PlaneTrack& track = planes_.start(found.kind, found.plane, found.centroid, keyframe.frame.epoch);
    for (int i : found.triangles) {
      track.cover(triangles[i], keyframe.id, T_map_C, nullptr);
      (*label)[i] = static_cast<int>(tracks->size());
    }
    if (track.area() < options_.support.sure_area) {
      track.keyframes_seen =
          evidence_.seenBy(track, keyframes_.posesTiedTo(keyframe.frame.epoch), options_.support.min_area);
    }
    tracks->push_back(&track);
  }
}

void PlaneMapper::Impl::startJointPlanes(const Keyframe& keyframe, const std::vector<JointPlane>& joint,
                                         std::vector<int>* label, std::vector<PlaneTrack*>* tracks) {
  for (const JointPlane& found : joint) {
    PlaneTrack& track = planes_.start(found.kind, found.plane, found.centroid, keyframe.frame.epoch);
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
  auto observations = observer_.observe(keyframe, T_map_C, labels, tracks);
  std::vector<PlaneId> ids;
  std::vector<char> trusted;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    PlaneTrack& track = *tracks[k];
    ids.push_back(track.id());
    if (area[k] > 0 && observations[k]) {
      planes_.observe(&track, std::move(*observations[k]));
      planes::fitToObservations(&track, keyframes_);
    }
    if (first_time && area[k] >= options_.support.min_area) {
      ++track.keyframes_seen;
      track.viewed_from = T_map_C.t();
    }
    const double covered = track.area();
    const bool seen = track.keyframes_seen >= options_.support.min_keyframes && covered >= options_.support.min_area;
    const bool large = track.keyframes_seen > 0 && covered >= options_.support.sure_area;
    track.confirmed = track.confirmed || seen || large;
    trusted.push_back(track.known() && track.determined && track.agrees);
  }
  points_.process(keyframe, labels, ids, trusted, keyframes_.poses(), [this](PlaneId id) { return findPlane(id); });
}

const Plane* PlaneMapper::Impl::findPlane(PlaneId id) {
  const PlaneTrack* track = planes_.find(id);
  return track ? &track->plane() : nullptr;
}

}  // namespace vip_slam
