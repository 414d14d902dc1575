// SPDX-License-Identifier: BSD-3-Clause
#include "plane_changes.h"

namespace vip_slam {

void PlaneChanges::withdraw(const PlaneTrack& track, KeyframeId keyframe) {
  const bool told = fresh_.erase({track.id(), keyframe}) == 0;
  if (!track.known() || !told) return;
  PlaneObservation none;
  none.keyframe = keyframe;
  none.plane = track.id();
  withdrawn_.push_back(none);
}

void PlaneChanges::removed(const PlaneTrack& track) {
  for (const auto& [keyframe, observation] : track.observations()) fresh_.erase({track.id(), keyframe});
  if (track.known()) removed_.push_back(track.id());
}

void PlaneChanges::merged(const PlaneTrack& from, const PlaneTrack& into) {
  const bool known = from.known();
  for (const auto& [keyframe, observation] : from.observations()) {
    // The back end renames the observations that it has. Those that it lacks, and joint ones of a keyframe that
    // observed both planes, are reported.
    if (!known || into.observations().count(keyframe) || fresh_.count({from.id(), keyframe})) {
      fresh_.emplace(into.id(), keyframe);
    }
    fresh_.erase({from.id(), keyframe});
  }
  // The back end renames invalid observations with the rest, so their withdrawal must follow.
  for (PlaneObservation& none : withdrawn_) {
    if (none.plane == from.id()) none.plane = into.id();
  }
  if (known) merges_.push_back({from.id(), into.id()});
}

void PlaneChanges::takeStructure(PlaneUpdate* update) {
  update->merges = std::move(merges_);
  update->removed = std::move(removed_);
  merges_.clear();
  removed_.clear();
}

void PlaneChanges::takeObservations(const std::map<PlaneId, PlaneTrack>& tracks, PlaneUpdate* update) {
  for (PlaneObservation& none : withdrawn_) {
    const auto it = tracks.find(none.plane);
    if (it == tracks.end()) continue;
    // A new observation of the same keyframe replaces the invalid one, unless it is not published yet.
    const bool observed = it->second.observations().count(none.keyframe) > 0;
    if (observed) fresh_.emplace(none.plane, none.keyframe);
    if (!observed || !it->second.determined) update->observations.push_back(none);
  }
  withdrawn_.clear();
  for (auto it = fresh_.begin(); it != fresh_.end();) {
    const auto track = tracks.find(it->first);
    if (track == tracks.end()) {
      it = fresh_.erase(it);
      continue;
    }
    if (!track->second.known() || !track->second.determined) {
      ++it;
      continue;
    }
    const auto observation = track->second.observations().find(it->second);
    if (observation != track->second.observations().end()) update->observations.push_back(observation->second);
    it = fresh_.erase(it);
  }
}

}  // namespace vip_slam
