// SPDX-License-Identifier: BSD-3-Clause
// What the next PlaneUpdate tells the back end: planes merged and removed, observations new and withdrawn.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/growth/plane_track.h"

namespace vip_slam {

class PlaneChanges {
 public:
  /// A new or joint observation of a keyframe; told once its plane is published and its direction determined.
  void observed(PlaneId plane, KeyframeId keyframe) { fresh_.emplace(plane, keyframe); }
  /// The keyframe is gone, and the back end knows.
  void forget(PlaneId plane, KeyframeId keyframe) { fresh_.erase({plane, keyframe}); }
  /// An observation became invalid: told if the back end may have it.
  void withdraw(const PlaneTrack& track, KeyframeId keyframe);
  /// A published plane is withdrawn from the map, whether or not it is kept here.
  void unpublished(PlaneId plane) { removed_.push_back(plane); }
  /// Before a plane is dropped.
  void removed(const PlaneTrack& track);
  /// Before `into` absorbs `from`.
  void merged(const PlaneTrack& from, const PlaneTrack& into);

  /// Moves merges and removals to the update.
  void takeStructure(PlaneUpdate* update);
  /// Moves the observations that can be told to the update.
  void takeObservations(const std::map<PlaneId, PlaneTrack>& tracks, PlaneUpdate* update);

 private:
  std::vector<PlaneMerge> merges_;
  std::vector<PlaneId> removed_;
  std::set<std::pair<PlaneId, KeyframeId>> fresh_;  ///< observations to report
  std::vector<PlaneObservation> withdrawn_;         ///< empty observations that replace invalid ones
};

}  // namespace vip_slam
