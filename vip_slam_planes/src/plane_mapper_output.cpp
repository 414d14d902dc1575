// SPDX-License-Identifier: BSD-3-Clause
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
  changes_.takeStructure(result);
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

  changes_.takeObservations(tracks_, result);
  result->associated = points_.takeAssociated();
  result->dissociated = points_.takeDissociated();
  counters.points_associated += result->associated.size();
  counters.points_dissociated += result->dissociated.size();
  counters.point_candidates = points_.candidates();
}

}  // namespace vip_slam
