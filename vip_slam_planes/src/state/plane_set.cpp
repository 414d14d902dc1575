// SPDX-License-Identifier: BSD-3-Clause
#include "plane_set.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vip_slam_planes/growth/see_through.h"

namespace vip_slam::planes {
namespace {

bool isFinite(const PlanePolygon& polygon) {
  const auto finite = [](const Ring& ring) {
    return std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
  };
  return finite(polygon.outer) && std::all_of(polygon.holes.begin(), polygon.holes.end(), finite);
}

bool isUsable(const StoredPlane& stored) {
  const PlaneEstimate& estimate = stored.estimate;
  return !estimate.polygons.empty() && !estimate.polygons.front().outer.empty() &&
         std::all_of(estimate.polygons.begin(), estimate.polygons.end(), isFinite) && isSound(estimate.plane) &&
         estimate.kind <= PlaneKind::kGeneral && stored.host.T_map_C.isFinite();
}

}  // namespace

bool isSound(const Plane& plane) {
  return plane.n.allFinite() && std::isfinite(plane.d) && std::abs(plane.n.norm() - 1) < 1e-3;
}

PlaneTrack* PlaneSet::find(PlaneId id) {
  const auto it = tracks_.find(id);
  return it == tracks_.end() ? nullptr : &it->second;
}

std::vector<PlaneTrack*> PlaneSet::inView(const SE3& T_map_C, std::uint32_t epoch, double range,
                                          const PlacedKeyframes& keyframes) {
  std::vector<PlaneTrack*> tracks;
  // Planes may also grow into view: the range is larger by the growth gap.
  for (auto& [id, track] : tracks_) {
    if (!keyframes.tied(track.epoch, epoch) || !track.seenSince(keyframes.sureSince(track.plane().n))) continue;
    if (mayBeInView(track, T_map_C, range + growth_.gap)) tracks.push_back(&track);
  }
  return tracks;
}

PlaneTrack& PlaneSet::start(PlaneKind kind, const Plane& plane, const Eigen::Vector3d& centroid, std::uint32_t epoch) {
  const PlaneId id = next_++;
  PlaneTrack& track = tracks_.try_emplace(id, id, kind, plane, centroid, growth_.cell).first->second;
  track.epoch = epoch;
  ++counts_.started;
  return track;
}

bool PlaneSet::restore(const StoredPlane& stored) {
  const auto& [estimate, host] = stored;
  next_ = std::max(next_, estimate.id + 1);
  if (tracks_.count(estimate.id)) return false;
  if (!isUsable(stored)) {
    changes_.unpublished(estimate.id);
    return false;
  }
  PlaneTrack track(estimate.id, estimate.kind, estimate.plane, estimate.polygons.front().outer.front(), growth_.cell);
  for (const PlanePolygon& polygon : estimate.polygons) {
    Ring2d outer;
    for (const Eigen::Vector3d& p : polygon.outer) outer.push_back(track.toPlane(p));
    std::vector<Ring2d> holes(polygon.holes.size());
    for (std::size_t i = 0; i < holes.size(); ++i) {
      for (const Eigen::Vector3d& p : polygon.holes[i]) holes[i].push_back(track.toPlane(p));
    }
    track.coverPolygon(outer, holes, growth_.min_hits, host);
  }
  track.stored = true;
  track.epoch = host.epoch;
  track.confirmed = track.determined = true;
  track.keyframes_seen = static_cast<int>(estimate.keyframes);
  tracks_.emplace(estimate.id, std::move(track));
  published_.push_back(estimate);
  return true;
}

void PlaneSet::remove(PlaneId id) {
  const auto it = tracks_.find(id);
  if (it == tracks_.end()) return;
  changes_.removed(it->second);
  counts_.removed += it->second.known();
  open_gaps_.remove(id);
  tracks_.erase(it);
}

std::vector<PlaneId> PlaneSet::dropUnsupported() {
  std::vector<PlaneId> gone;
  for (const auto& [id, track] : tracks_) {
    // A small plane that several keyframes started may still grow; it is not published until it is confirmed.
    const bool shrunk = (track.confirmed && track.area() < support_.min_area) || track.mostlyGone();
    const bool never_confirmed = !track.confirmed && track.keyframes_waited > support_.patience;
    if (shrunk || never_confirmed) gone.push_back(id);
  }
  for (PlaneId id : gone) remove(id);
  return gone;
}

void PlaneSet::observe(PlaneTrack* track, PlaneObservation observation) {
  const KeyframeId keyframe = observation.keyframe;
  track->observations().insert_or_assign(keyframe, std::move(observation));
  changes_.observed(track->id(), keyframe);
}

void PlaneSet::withdraw(PlaneTrack* track, KeyframeId keyframe) {
  changes_.withdraw(*track, keyframe);
  track->observations().erase(keyframe);
  track->refit_due = true;
}

void PlaneSet::unpublish(PlaneTrack* track) {
  changes_.unpublished(track->id());
  ++counts_.removed;
  track->setOptimised(false);
  track->refit_due = true;
}

void PlaneSet::republish(const PlaneTrack& track) {
  for (const auto& [keyframe, observation] : track.observations()) changes_.observed(track.id(), keyframe);
}

void PlaneSet::forgetKeyframe(KeyframeId id, KeyframeId heir, const CameraPoses& poses) {
  for (auto& [plane, track] : tracks_) {
    track.rehost(id, heir, poses);
    changes_.forget(plane, id);
  }
}

void PlaneSet::tell(PlaneUpdate* update) {
  changes_.takeStructure(update);
  published_.clear();
  for (auto& [id, track] : tracks_) {
    if (!track.known()) continue;
    PlaneEstimate estimate;
    estimate.polygons = track.polygons(growth_.min_hits);
    estimate.area = track.cells().count(growth_.min_hits) * track.cellSize() * track.cellSize();
    estimate.id = id;
    estimate.kind = track.kind();
    estimate.plane = track.plane();
    estimate.keyframes = static_cast<std::uint32_t>(track.keyframes_seen);
    published_.push_back(std::move(estimate));
  }
  update->planes = published_;
  changes_.takeObservations(tracks_, update);
}

void PlaneSet::clear() {
  tracks_.clear();
  next_ = 1;
  open_gaps_.clear();
  compare_all_ = false;
  changes_ = PlaneChanges();
  published_.clear();
}

}  // namespace vip_slam::planes
