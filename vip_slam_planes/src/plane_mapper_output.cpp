// Output to the back end after an update.
#include <utility>
#include <vector>

#include "plane_mapper_impl.h"

namespace vip_slam {

void PlaneMapper::Impl::dropUnsupported(PlaneUpdate* result) {
  std::vector<PlaneId> gone;
  for (const auto& [id, track] : tracks_) {
    // A small plane that several keyframes started may still grow; it is not published until it is confirmed.
    const bool shrunk = (track.confirmed && track.area() < options.support.min_area) || track.mostlyGone();
    const bool never_confirmed = !track.confirmed && track.keyframes_waited > options.support.patience;
    if (shrunk || never_confirmed) gone.push_back(id);
  }
  for (PlaneId id : gone) removePlane(id);
  result->merges = std::move(merges_);
  result->removed = std::move(removed_);
  merges_.clear();
  removed_.clear();
}

void PlaneMapper::Impl::publish(PlaneUpdate* result) {
  published.clear();
  for (auto& [id, track] : tracks_) {
    if (!track.known()) continue;
    PlaneEstimate estimate;
    estimate.polygons = track.polygons(options.growth.min_hits);
    estimate.area = track.cells().count(options.growth.min_hits) * track.cellSize() * track.cellSize();
    estimate.id = id;
    estimate.kind = track.kind();
    estimate.plane = track.plane();
    estimate.keyframes = static_cast<std::uint32_t>(track.keyframes_seen);
    published.push_back(std::move(estimate));
  }
  result->planes = published;

  for (PlaneObservation& none : withdrawn_) {
    const auto it = tracks_.find(none.plane);
    if (it == tracks_.end()) continue;
    // A new observation of the same keyframe replaces the invalid one, unless it is not published yet.
    const bool observed = it->second.observations().count(none.keyframe) > 0;
    if (observed) fresh_.emplace(none.plane, none.keyframe);
    if (!observed || !it->second.determined) result->observations.push_back(none);
  }
  withdrawn_.clear();
  for (auto it = fresh_.begin(); it != fresh_.end();) {
    const auto track = tracks_.find(it->first);
    if (track == tracks_.end()) {
      it = fresh_.erase(it);
      continue;
    }
    if (!track->second.known() || !track->second.determined) {
      ++it;
      continue;
    }
    const auto observation = track->second.observations().find(it->second);
    if (observation != track->second.observations().end()) result->observations.push_back(observation->second);
    it = fresh_.erase(it);
  }
  result->associated = points_.takeAssociated();
  result->dissociated = points_.takeDissociated();
  counters.points_associated += result->associated.size();
  counters.points_dissociated += result->dissociated.size();
  counters.point_candidates = points_.candidates();
}

}  // namespace vip_slam
