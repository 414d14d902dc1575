// SPDX-License-Identifier: BSD-3-Clause
// Which planes of the set are merged, and into which.
#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "fit_to_observations.h"
#include "plane_set.h"
#include "vip_slam_planes/merging/plane_merging.h"

namespace vip_slam::planes {

// A piece of a wall seen from afar may pass for the door in it as well: it goes to the one that it suits best.
PlaneId PlaneSet::samePlane(PlaneId id, const PlacedKeyframes& keyframes, const SceneView& view) const {
  const PlaneTrack& mine = tracks_.at(id);
  PlaneId best = 0;
  double least = std::numeric_limits<double>::infinity();
  const KeyframeId since = keyframes.sureSince(mine.plane().n);
  for (const auto& [other_id, other] : tracks_) {
    if (other_id == id || !keyframes.tied(mine.epoch, other.epoch)) continue;
    if (other.seenSince(since) != mine.seenSince(since)) continue;
    if (!sameSurface(mine, other, view, merging_)) continue;
    const double misfit = jointMisfit(mine, other, keyframes.poses());
    if (best == 0 || misfit < least) best = other_id, least = misfit;
  }
  return best;
}

std::vector<PlaneMerge> PlaneSet::mergeSame(const PlacedKeyframes& keyframes, const CameraModel& camera) {
  std::set<PlaneId> open;
  for (auto& [id, track] : tracks_) {
    if (track.changed(true) || compare_all_) open.insert(id);
  }
  compare_all_ = false;
  const PlaneViews views = keyframes.views();
  const SceneView view{views, camera, support_.see_through, open_gaps_};
  std::vector<PlaneMerge> merges;
  // Each merge may make further merges possible; each removes a plane, so this terminates.
  while (!open.empty()) {
    const PlaneId id = *open.begin();
    open.erase(open.begin());
    PlaneId one = id, other = tracks_.count(id) ? samePlane(id, keyframes, view) : 0;
    if (other == 0) continue;
    // On to the plane that suits each better, until two suit each other best; bounded, whatever the misfits are.
    for (std::size_t steps = 0; steps < tracks_.size(); ++steps) {
      const PlaneId better = samePlane(other, keyframes, view);
      if (better == one || better == 0) break;
      one = other, other = better;
    }
    if (one != id && other != id) open.insert(id);
    // The older id is kept, unless only the newer one is known to the back end.
    PlaneId into = std::min(one, other), from = std::max(one, other);
    if (tracks_.at(from).known() && !tracks_.at(into).known()) std::swap(into, from);
    merges.push_back({from, into});
    merge(merges.back(), keyframes);
    open.erase(from);
    open.insert(into);
  }
  return merges;
}

void PlaneSet::merge(const PlaneMerge& merge, const PlacedKeyframes& keyframes) {
  PlaneTrack& into = tracks_.at(merge.into);
  const PlaneTrack& from = tracks_.at(merge.from);
  changes_.merged(from, into);
  into.absorb(from, keyframes.poses());
  fitToObservations(&into, keyframes);
  open_gaps_.rename(merge.from, merge.into);
  into.takes_points = false;  // so that candidates of the other plane are decided on as well
  tracks_.erase(merge.from);
  ++counts_.merged;
}

}  // namespace vip_slam::planes
