// Corrections from the back end.
#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>

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
  came_together_ = epochs_.tie(update.parts) || came_together_;
  followMode(update);
  if (localising_) {
    // Planes must not change now; changes from before are reported once mapping goes on.
    for (KeyframeId id : update.removed_keyframes) removeKeyframe(id);
    points_.applyMapUpdate(update);
    counters.keyframes_waiting = waiting_.size();
    result.planes = published;
    return result;
  }
  takeCorrections(update);

  for (const KeyframeEstimate& estimate : update.keyframes) {
    const auto it = waiting_.find(estimate.id);
    if (it == waiting_.end() || !isSound(estimate)) continue;
    const KeyframePtr keyframe = withCameraCorrection(it->second, estimate.camera_correction);
    waiting_.erase(it);
    placed_[keyframe->id] = keyframe;
    poses_[keyframe->id] = estimate.state.T_W_I * estimate.T_I_C;
    if (keyframe->id > newest_) newest_ = keyframe->id, epoch_ = keyframe->frame.epoch;
    epoch_of_[keyframe->id] = keyframe->frame.epoch;
    epochs_.add(keyframe->frame.epoch);
    points_.addSightings(*keyframe);
    processKeyframe(*keyframe, true);
  }
  counters.keyframes_waiting = waiting_.size();

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
  const bool maps =
      update.global || std::any_of(update.keyframes.begin(), update.keyframes.end(),
                                   [this](const KeyframeEstimate& k) { return waiting_.count(k.id) > 0; });
  const bool gives_back = std::any_of(update.removed_keyframes.begin(), update.removed_keyframes.end(),
                                      [this](KeyframeId id) { return waiting_.count(id) > 0; });
  localising_ = !maps && (localising_ || gives_back);
}

// Candidate points wait until their plane takes points; most of them are out of view by then, so all are decided on.
void PlaneMapper::Impl::decideOnPoints() {
  for (auto& [id, track] : tracks_) {
    const bool before = track.takes_points;
    track.takes_points = track.known() && track.determined && track.agrees;
    if (track.takes_points && !before) points_.decide(id, track.plane(), poses_);
  }
}

// A global update lists all keyframes of the map. A keyframe that it does not list was removed in an update that was
// lost, or was never inserted.
void PlaneMapper::Impl::removeUnnamed(const MapUpdate& update) {
  std::set<KeyframeId> named;
  for (const KeyframeEstimate& estimate : update.keyframes) named.insert(estimate.id);
  std::vector<KeyframeId> gone;
  for (const auto& [id, epoch] : epoch_of_) {
    if (!named.count(id)) gone.push_back(id);
  }
  for (KeyframeId id : gone) removeKeyframe(id);
  for (auto it = waiting_.begin(); it != waiting_.end() && it->first <= update.newest_keyframe;) {
    it = named.count(it->first) ? std::next(it) : waiting_.erase(it);
  }
}

void PlaneMapper::Impl::takeCorrections(const MapUpdate& update) {
  map_moved_ = update.global;
  // Before any pose changes: the cells of removed keyframes are handed over at their present place, and then move with
  // their new host.
  for (KeyframeId id : update.removed_keyframes) removeKeyframe(id);
  if (update.global) removeUnnamed(update);
  std::vector<KeyframeId> moved;
  for (const KeyframeEstimate& estimate : update.keyframes) {
    const auto pose = poses_.find(estimate.id);
    if (pose == poses_.end() || !isSound(estimate)) continue;
    SE3& T_map_C = pose->second;
    const SE3 corrected = estimate.state.T_W_I * estimate.T_I_C;
    const SE3 move = T_map_C.inverse() * corrected;
    map_moved_ = map_moved_ || move.t().norm() > kMovedShift || logSO3(move.rotation()).norm() > kMovedTurn;
    const auto it = placed_.find(estimate.id);
    const bool other_depth = it != placed_.end() && adoptCameraCorrection(estimate.camera_correction, &it->second);
    if (other_depth || T_map_C.matrix() != corrected.matrix()) moved.push_back(estimate.id);
    T_map_C = corrected;
  }
  if (map_moved_) {
    for (auto& [id, track] : tracks_) track.turnWithKeyframes(poses_);
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
    if (concerned) track.followKeyframes(poses_);
  }
  if (map_moved_) {
    evidence_.forgetTests();
    withdrawBrokenObservations();
  }
  judgeAgreement();
  if (update.global) points_.recheck([this](PlaneId id) { return findPlane(id); });
}

// Covered cells and detection's left-over triangles are not corrected: they are coarser than any such correction.
bool PlaneMapper::Impl::adoptCameraCorrection(const CameraCorrection& correction, KeyframePtr* keyframe) {
  const KeyframePtr corrected = withCameraCorrection(*keyframe, correction);
  if (corrected == *keyframe) return false;
  *keyframe = corrected;
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
      const auto pose = poses_.find(keyframe);
      if (pose == poses_.end()) continue;
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
      removed_.push_back(id);
      ++counters.planes_removed;
      track.setOptimised(false);
      track.refit_due = true;
    }
    for (auto it = track.observations().begin(); hidden && track.known() && it != track.observations().end(); ++it) {
      fresh_.emplace(id, it->first);
    }
  }
}

// Removes the observations of a moved surface from before the move. True when it was moved.
bool PlaneMapper::Impl::forgetWhereItWas(PlaneTrack* track) {
  const KeyframeId since = surfaceMovedAt(*track, poses_);
  if (since == 0) return false;
  auto& observations = track->observations();
  while (!observations.empty() && observations.begin()->first < since) {
    withdraw(*track, observations.begin()->first);
    observations.erase(observations.begin());
  }
  track->setOptimised(false);
  refit(track);
  return true;
}

// Reports an invalid observation to the back end, if it was published there.
void PlaneMapper::Impl::withdraw(const PlaneTrack& track, KeyframeId keyframe) {
  const bool told = fresh_.erase({track.id(), keyframe}) == 0;
  if (!track.known() || !told) return;
  PlaneObservation none;
  none.keyframe = keyframe;
  none.plane = track.id();
  withdrawn_.push_back(none);
}

void PlaneMapper::Impl::removeKeyframe(KeyframeId id) {
  waiting_.erase(id);
  const auto it = epoch_of_.find(id);
  if (it == epoch_of_.end()) return;
  // Its cells go to the neighbour in time, which moves nearly alike, if their epochs are tied.
  const auto moves_alike = [&](const auto& other) { return epochs_.tied(other.second, it->second); };
  KeyframeId heir = 0;
  if (it != epoch_of_.begin() && moves_alike(*std::prev(it))) {
    heir = std::prev(it)->first;
  } else if (std::next(it) != epoch_of_.end() && moves_alike(*std::next(it))) {
    heir = std::next(it)->first;
  }
  for (auto& [plane, track] : tracks_) {
    track.rehost(id, heir, poses_);
    fresh_.erase({plane, id});
  }
  epoch_of_.erase(it);
  poses_.erase(id);
  const auto placed = placed_.find(id);
  if (placed == placed_.end()) return;
  points_.removeKeyframe(*placed->second);
  evidence_.remove(id);
  strips_.remove(id);
  placed_.erase(placed);
  if (points_.aliases().crowded()) forgetAliases();
  if (newest_ != id) return;
  newest_ = placed_.empty() ? 0 : placed_.rbegin()->first;
  if (newest_ != 0) epoch_ = placed_.rbegin()->second->frame.epoch;
}

void PlaneMapper::Impl::forgetAliases() {
  std::unordered_set<LandmarkId> in_use;
  for (const auto* keyframes : {&placed_, &waiting_}) {
    for (const auto& [other, keyframe] : *keyframes) {
      for (const Feature& f : keyframe->frame.features) in_use.insert(f.id);
    }
  }
  points_.aliases().forgetUnused(in_use);
}

// Until the body has moved, the gravity direction may be wrong by a degree, so that horizontal and vertical surfaces
// lean in the map.
double PlaneMapper::Impl::gravitySigma() const {
  const auto newest = placed_.find(newest_);
  if (newest == placed_.end()) return 0;
  const TrackedFrame& frame = newest->second->frame;
  const Eigen::Matrix3d R = frame.state.T_W_I.R();
  const Eigen::Matrix3d covariance = R * frame.covariance.topLeftCorner<3, 3>() * R.transpose();
  const double variance = covariance.diagonal().head<2>().maxCoeff();
  return std::isfinite(variance) ? std::sqrt(std::max(0.0, variance)) : 0.0;
}

void PlaneMapper::Impl::refit(PlaneTrack* track) {
  track->refit_due = false;
  if (track->optimised() && track->determined) return;
  const PlaneMoments moments = track->moments(poses_);
  if (!(moments.weight() > 0)) return;
  track->determined = normalSigma(moments, track->kind()) < kSureDirection;
  if (track->optimised()) return;
  // Until the samples determine the direction, keep that of detection, which used the surface up to its border.
  Plane plane = Plane::fromPointNormal(moments.centroid(), track->plane().n);
  if (track->determined && !fitLeaningPlane(moments, track->kind(), gravitySigma(), track->plane().n, &plane)) return;
  track->setPlane(plane);
}

void PlaneMapper::Impl::withdrawBrokenObservations() {
  // Samples that are off their plane at the corrected poses belong to another surface, or to another piece of it.
  std::set<KeyframeId> renewed;
  for (auto& [id, track] : tracks_) {
    for (auto it = track.observations().begin(); it != track.observations().end();) {
      const auto pose = poses_.find(it->first);
      const PlaneMoments moments{it->second.G};
      const bool holds =
          pose == poses_.end() || moments.meanSquare(transformPlane(pose->second.inverse(), track.plane())) <
                                      options.growth.distance * options.growth.distance;
      if (holds) {
        ++it;
        continue;
      }
      withdraw(track, it->first);
      renewed.insert(it->first);
      it = track.observations().erase(it);
      track.refit_due = true;
    }
  }
  while (renewed.size() > kMaxRenewed) renewed.erase(renewed.begin());  // keep the newest
  for (KeyframeId id : renewed) processKeyframe(*placed_.at(id), false);
}

}  // namespace vip_slam
