// SPDX-License-Identifier: BSD-3-Clause
// What the back end changes: corrections of the map, another map.
#include <algorithm>
#include <set>
#include <vector>

#include "plane_mapper_impl.h"
#include "state/fit_to_observations.h"
#include "vip_slam_core/geometry/plane_noise.h"
#include "vip_slam_core/types/camera_correction.h"
#include "vip_slam_planes/growth/moved_surface.h"

namespace vip_slam {

PlaneUpdate PlaneMapper::Impl::applyMapUpdate(const MapUpdate& update) {
  const ScopedTimer timer(timing_, "planes.update", update.t);
  PlaneUpdate result;
  result.revision = update.revision;
  result.t = update.t;
  if (keyframes_.tie(update)) planes_.compareAll();
  mode_.follow(update, keyframes_);
  if (mode_.localising()) {
    // Planes must not change now; changes from before are reported once mapping goes on.
    for (KeyframeId id : update.removed_keyframes) removeKeyframe(id);
    points_.applyMapUpdate(update);
    result.planes = planes_.published();
    return result;
  }
  takeCorrections(update);

  for (const KeyframeEstimate& estimate : update.keyframes) {
    const KeyframePtr keyframe = keyframes_.place(estimate, options_.merging.distance);
    if (!keyframe) continue;
    points_.addSightings(*keyframe);
    processKeyframe(*keyframe, true);
  }

  for (const auto& [from, into] : planes_.mergeSame(keyframes_, *camera_)) points_.renamePlane(from, into);
  for (PlaneId id : planes_.dropUnsupported()) points_.removePlane(id);
  decideOnPoints();
  tell(&result);
  return result;
}

void PlaneMapper::Impl::clear() {
  keyframes_ = PlacedKeyframes(noise_);
  planes_.clear();
  points_.clear();
  evidence_.clear();
  pace_.clear();
  mode_ = planes::BackEndMode();
}

void PlaneMapper::Impl::restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe) {
  clear();
  keyframes_ = PlacedKeyframes(noise_, newest_keyframe);
  for (const StoredPlane& plane : planes) {
    if (planes_.restore(plane)) keyframes_.addHost(plane.host);
  }
}

// Candidate points wait until their plane takes points; most of them are out of view by then, so all are decided on.
void PlaneMapper::Impl::decideOnPoints() {
  for (auto& [id, track] : planes_) {
    const bool before = track.takes_points;
    track.takes_points = track.known() && track.determined && track.agrees;
    if (track.takes_points && !before) points_.decide(id, track.plane(), keyframes_.poses());
  }
}

void PlaneMapper::Impl::tell(PlaneUpdate* result) {
  planes_.tell(result);
  result->associated = points_.takeAssociated();
  result->dissociated = points_.takeDissociated();
  counters_.points_associated += result->associated.size();
  counters_.points_dissociated += result->dissociated.size();
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
  bool map_moved = update.global;  // so far that what a keyframe shows may be farther from its plane than it may be
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
    const double swing = move.t().norm() + noise_.max_range * logSO3(move.rotation()).norm();
    map_moved = map_moved || swing > options_.growth.distance;
    const auto it = keyframes_.placed().find(estimate.id);
    const bool other_depth =
        it != keyframes_.placed().end() && adoptCameraCorrection(estimate.camera_correction, it->second);
    if (other_depth || T_map_C.matrix() != corrected.matrix()) moved.push_back(estimate.id);
    keyframes_.move(estimate.id, corrected);
  }
  if (map_moved) {
    for (auto& [id, track] : planes_) track.turnWithKeyframes(keyframes_.poses());
  }
  for (const auto& [id, plane] : update.planes) {
    PlaneTrack* track = planes_.find(id);
    if (!track || !track->known() || !planes::isSound(plane) || track->followsHosts()) continue;
    // Without observations of a plane the back end only returns the parameters that it received from here.
    if (!track->determined) continue;
    track->setPlane(plane);
    track->setOptimised(true);
  }
  points_.applyMapUpdate(update);
  const bool removed = !update.removed_keyframes.empty();
  for (auto& [id, track] : planes_) {
    const bool concerned = removed || std::any_of(moved.begin(), moved.end(), [&track = track](KeyframeId keyframe) {
                             return track.restsOn(keyframe);
                           });
    if (!track.optimised() && (concerned || track.refit_due)) planes::fitToObservations(&track, keyframes_);
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
  for (auto& [id, track] : planes_) {
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
  for (const auto& [id, track] : planes_) {
    for (const auto& [keyframe, observation] : track.observations()) {
      const auto pose = keyframes_.poses().find(keyframe);
      if (pose == keyframes_.poses().end()) continue;
      const Plane plane_C = transformPlane(pose->second.inverse(), track.plane());
      const Eigen::Matrix4d G = samplesOf(observation).M;
      const double misfit = planeMisfit(G, plane_C.coefficients()), weight = G(3, 3);
      misfits.push_back({static_cast<int>(index), misfit, weight > 0 ? misfit / weight : 0.0});
    }
    ++index;
  }
  const std::vector<char> agree = planesAgree(misfits, index);
  index = 0;
  for (auto& [id, track] : planes_) {
    const bool known = track.known(), hidden = track.confirmed && !known;
    track.agrees = agree[index++] != 0 || forgetWhereItWas(&track);
    if (!track.agrees) points_.releaseFrom(id);
    if (known && !track.known()) planes_.unpublish(&track);
    if (hidden && track.known()) planes_.republish(track);
  }
}

// Removes the observations of a moved surface from before the move. True when it was moved.
bool PlaneMapper::Impl::forgetWhereItWas(PlaneTrack* track) {
  const KeyframeId since =
      surfaceMovedAt(*track, keyframes_.poses(), options_.support.min_views, options_.merging.max_rms);
  if (since == 0) return false;
  const auto& observations = track->observations();
  while (!observations.empty() && observations.begin()->first < since) {
    planes_.withdraw(track, observations.begin()->first);
  }
  track->setOptimised(false);
  planes::fitToObservations(track, keyframes_);
  return true;
}

void PlaneMapper::Impl::removeKeyframe(KeyframeId id) {
  keyframes_.stopWaiting(id);
  if (!keyframes_.hasPose(id)) return;
  const KeyframeId heir = keyframes_.heirOf(id);  // of its cells
  planes_.forgetKeyframe(id, heir, keyframes_.poses());
  const KeyframePtr placed = keyframes_.remove(id);
  if (!placed) return;
  points_.removeKeyframe(*placed);
  evidence_.remove(id);
  if (points_.aliases().crowded()) points_.aliases().forgetUnused(keyframes_.tracks());
}

void PlaneMapper::Impl::withdrawBrokenObservations() {
  // Samples that are off their plane at the corrected poses belong to another surface, or to another piece of it.
  std::set<KeyframeId> renewed;
  const CameraPoses& poses = keyframes_.poses();
  for (auto& [id, track] : planes_) {
    std::vector<KeyframeId> broken;
    for (const auto& [keyframe, observation] : track.observations()) {
      const auto pose = poses.find(keyframe);
      const PlaneMoments moments = samplesOf(observation);
      const bool holds =
          pose == poses.end() || moments.meanSquare(transformPlane(pose->second.inverse(), track.plane())) <
                                     options_.growth.distance * options_.growth.distance;
      if (!holds) broken.push_back(keyframe);
    }
    for (KeyframeId keyframe : broken) planes_.withdraw(&track, keyframe);
    renewed.insert(broken.begin(), broken.end());
  }
  const auto newest = static_cast<std::size_t>(options_.detection.keyframes);  // those a plane may start from
  while (renewed.size() > newest) renewed.erase(renewed.begin());
  for (KeyframeId id : renewed) processKeyframe(*keyframes_.placed().at(id), false);
}

}  // namespace vip_slam
