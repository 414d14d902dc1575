// SPDX-License-Identifier: BSD-3-Clause
// Corrections from the back end.
#include <algorithm>
#include <cmath>
#include <set>

#include "plane_mapper_impl.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/plane_noise.h"
#include "vip_slam_core/types/camera_correction.h"
#include "vip_slam_planes/growth/moved_surface.h"

namespace vip_slam {
namespace {

// Largest number of keyframes per update that are processed again after the map has moved their observations off
// planes.
constexpr std::size_t kMaxRenewed = 10;
constexpr double kSureDirection = 2.0 * kDegree;                  // largest sigma of a determined direction, rad
constexpr double kMovedTurn = 0.5 * kDegree, kMovedShift = 0.02;  // of a keyframe by one update, rad and m

}  // namespace

PlaneUpdate PlaneMapper::Impl::applyMapUpdate(const MapUpdate& update) {
  const ScopedTimer timer(timing, "planes.update", update.t);
  PlaneUpdate result;
  result.revision = update.revision;
  result.t = update.t;
  came_together_ = keyframes_.tie(update) || came_together_;
  followMode(update);
  if (localising_) {
    // Planes must not change now; changes from before are reported once mapping goes on.
    for (KeyframeId id : update.removed_keyframes) removeKeyframe(id);
    points_.applyMapUpdate(update);
    counters.keyframes_waiting = keyframes_.waiting();
    result.planes = published;
    return result;
  }
  takeCorrections(update);

  for (const KeyframeEstimate& estimate : update.keyframes) {
    const KeyframePtr keyframe = keyframes_.place(estimate, options.growth.distance);
    if (!keyframe) continue;
    points_.addSightings(*keyframe);
    processKeyframe(*keyframe, true);
  }
  counters.keyframes_waiting = keyframes_.waiting();

  std::vector<PlaneId> changed;
  for (auto& [id, track] : tracks_) {
    if (track.changed(true) || came_together_) changed.push_back(id);
  }
  came_together_ = false;
  mergePlanes(changed);
  dropUnsupported(&result);
  decideOnPoints();
  publish(&result);
  return result;
}

// Detects the back end's mode: in localisation-only mode it removes each waiting keyframe at once; a keyframe that it
// places, or a global update, shows that it maps.
void PlaneMapper::Impl::followMode(const MapUpdate& update) {
  const bool maps = update.global || std::any_of(update.keyframes.begin(), update.keyframes.end(),
                                                 [this](const KeyframeEstimate& k) { return keyframes_.waits(k.id); });
  const bool gives_back = std::any_of(update.removed_keyframes.begin(), update.removed_keyframes.end(),
                                      [this](KeyframeId id) { return keyframes_.waits(id); });
  localising_ = !maps && (localising_ || gives_back);
}

// Candidate points wait until their plane takes points; most of them are out of view by then, so all are decided on.
void PlaneMapper::Impl::decideOnPoints() {
  for (auto& [id, track] : tracks_) {
    const bool before = track.takes_points;
    track.takes_points = track.known() && track.determined && track.agrees;
    if (track.takes_points && !before) points_.decide(id, track.plane(), keyframes_.poses());
  }
}

// A global update lists all keyframes of the map. A keyframe that it does not list was removed in an update that was
// lost, or was never inserted.
void PlaneMapper::Impl::removeUnnamed(const MapUpdate& update) {
  std::set<KeyframeId> named;
  for (const KeyframeEstimate& estimate : update.keyframes) named.insert(estimate.id);
  for (KeyframeId id : keyframes_.unnamed(named)) removeKeyframe(id);
  keyframes_.stopWaiting(named, update.newest_keyframe);
}

void PlaneMapper::Impl::takeCorrections(const MapUpdate& update) {
  bool map_moved = update.global;  // by a noticeable amount
  // Before any pose changes: the cells of removed keyframes are handed over at their present place, and then move with
  // their new host.
  for (KeyframeId id : update.removed_keyframes) removeKeyframe(id);
  if (update.global) removeUnnamed(update);
  std::vector<KeyframeId> moved;
  for (const KeyframeEstimate& estimate : update.keyframes) {
    const auto pose = keyframes_.poses().find(estimate.id);
    if (pose == keyframes_.poses().end() || !isSound(estimate)) continue;
    const SE3 T_map_C = pose->second, corrected = estimate.state.T_W_I * estimate.T_I_C;
    const SE3 move = T_map_C.inverse() * corrected;
    map_moved = map_moved || move.t().norm() > kMovedShift || logSO3(move.rotation()).norm() > kMovedTurn;
    const auto it = keyframes_.placed().find(estimate.id);
    const bool other_depth =
        it != keyframes_.placed().end() && adoptCameraCorrection(estimate.camera_correction, it->second);
    if (other_depth || T_map_C.matrix() != corrected.matrix()) moved.push_back(estimate.id);
    keyframes_.move(estimate.id, corrected);
  }
  if (map_moved) {
    for (auto& [id, track] : tracks_) track.turnWithKeyframes(keyframes_.poses());
  }
  for (const auto& [id, plane] : update.planes) {
    const auto it = tracks_.find(id);
    if (it == tracks_.end() || !it->second.known() || !isSound(plane) || it->second.followsHosts()) continue;
    // Without observations of a plane the back end only returns the parameters that it received from here.
    if (!it->second.determined) continue;
    it->second.setPlane(plane);
    it->second.setOptimised(true);
  }
  points_.applyMapUpdate(update);
  const bool removed = !update.removed_keyframes.empty();
  for (auto& [id, track] : tracks_) {
    const bool concerned = removed || std::any_of(moved.begin(), moved.end(), [&track = track](KeyframeId keyframe) {
                             return track.restsOn(keyframe);
                           });
    if (!track.optimised() && (concerned || track.refit_due)) refit(&track);
    if (concerned) track.followKeyframes(keyframes_.poses());
  }
  if (map_moved) {
    evidence_.forgetTests();
    withdrawBrokenObservations();
  }
  judgeAgreement();
  if (update.global) points_.recheck([this](PlaneId id) { return findPlane(id); });
}

// Covered cells and detection's left-over triangles are not corrected: they are coarser than any such correction.
bool PlaneMapper::Impl::adoptCameraCorrection(const CameraCorrection& correction, const KeyframePtr& keyframe) {
  const KeyframePtr corrected = withCameraCorrection(keyframe, correction);
  if (corrected == keyframe) return false;
  keyframes_.replace(corrected);
  points_.renewSightings(*corrected);
  for (auto& [id, track] : tracks_) {
    const auto observation = track.observations().find(corrected->id);
    if (observation != track.observations().end()) setCameraCorrection(correction, &observation->second);
  }
  return true;
}

// A plane whose observations disagree may be several surfaces, such as the fronts of boxes on a shelf: it takes no
// points and, if vertical, is withdrawn from the map until they agree. It is kept here, so that the same triangles do
// not start it again. Horizontal planes stay in the map, since objects on a table disagree with the table as well.
void PlaneMapper::Impl::judgeAgreement() {
  std::vector<PlaneMisfit> misfits;
  std::size_t index = 0;
  for (const auto& [id, track] : tracks_) {
    for (const auto& [keyframe, observation] : track.observations()) {
      const auto pose = keyframes_.poses().find(keyframe);
      if (pose == keyframes_.poses().end()) continue;
      const Plane plane_C = transformPlane(pose->second.inverse(), track.plane());
      const Eigen::Matrix4d G = viewMoments(observation).M;
      const double misfit = planeMisfit(G, plane_C.coefficients()), weight = G(3, 3);
      misfits.push_back({static_cast<int>(index), misfit, weight > 0 ? misfit / weight : 0.0});
    }
    ++index;
  }
  const std::vector<char> agree = planesAgree(misfits, index);
  index = 0;
  for (auto& [id, track] : tracks_) {
    const bool known = track.known(), hidden = track.confirmed && !known;
    track.agrees = agree[index++] != 0 || forgetWhereItWas(&track);
    if (!track.agrees) points_.releaseFrom(id);
    if (known && !track.known()) {
      changes_.unpublished(id);
      ++counters.planes_removed;
      track.setOptimised(false);
      track.refit_due = true;
    }
    for (auto it = track.observations().begin(); hidden && track.known() && it != track.observations().end(); ++it) {
      changes_.observed(id, it->first);
    }
  }
}

// Removes the observations of a moved surface from before the move. True when it was moved.
bool PlaneMapper::Impl::forgetWhereItWas(PlaneTrack* track) {
  const KeyframeId since = surfaceMovedAt(*track, keyframes_.poses());
  if (since == 0) return false;
  auto& observations = track->observations();
  while (!observations.empty() && observations.begin()->first < since) {
    changes_.withdraw(*track, observations.begin()->first);
    observations.erase(observations.begin());
  }
  track->setOptimised(false);
  refit(track);
  return true;
}

void PlaneMapper::Impl::removeKeyframe(KeyframeId id) {
  keyframes_.stopWaiting(id);
  if (!keyframes_.hasPose(id)) return;
  const KeyframeId heir = keyframes_.heirOf(id);  // of its cells
  for (auto& [plane, track] : tracks_) {
    track.rehost(id, heir, keyframes_.poses());
    changes_.forget(plane, id);
  }
  const KeyframePtr placed = keyframes_.remove(id);
  if (!placed) return;
  points_.removeKeyframe(*placed);
  evidence_.remove(id);
  strips_.remove(id);
  if (points_.aliases().crowded()) points_.aliases().forgetUnused(keyframes_.tracks());
}

void PlaneMapper::Impl::refit(PlaneTrack* track) {
  track->refit_due = false;
  if (track->optimised() && track->determined) return;
  const PlaneMoments moments = track->moments(keyframes_.poses());
  if (!(moments.weight() > 0)) return;
  track->determined = normalSigma(moments, track->kind()) < kSureDirection;
  if (track->optimised()) return;
  // Until the samples determine the direction, keep that of detection, which used the surface up to its border.
  Plane plane = Plane::fromPointNormal(moments.centroid(), track->plane().n);
  if (track->determined &&
      !fitLeaningPlane(moments, track->kind(), keyframes_.gravitySigma(), track->plane().n, &plane))
    return;
  track->setPlane(plane);
}

void PlaneMapper::Impl::withdrawBrokenObservations() {
  // Samples that are off their plane at the corrected poses belong to another surface, or to another piece of it.
  std::set<KeyframeId> renewed;
  const CameraPoses& poses = keyframes_.poses();
  for (auto& [id, track] : tracks_) {
    for (auto it = track.observations().begin(); it != track.observations().end();) {
      const auto pose = poses.find(it->first);
      const PlaneMoments moments{it->second.G};
      const bool holds =
          pose == poses.end() || moments.meanSquare(transformPlane(pose->second.inverse(), track.plane())) <
                                     options.growth.distance * options.growth.distance;
      if (holds) {
        ++it;
        continue;
      }
      changes_.withdraw(track, it->first);
      renewed.insert(it->first);
      it = track.observations().erase(it);
      track.refit_due = true;
    }
  }
  while (renewed.size() > kMaxRenewed) renewed.erase(renewed.begin());  // keep the newest
  for (KeyframeId id : renewed) processKeyframe(*keyframes_.placed().at(id), false);
}

}  // namespace vip_slam
