// SPDX-License-Identifier: BSD-3-Clause
// The back end takes over what the plane module reports.
#include <set>
#include <vector>

#include "back_end_impl.h"

namespace vip_slam {

void BackEnd::Impl::applyPlaneUpdate(const PlaneUpdate& update) {
  if (!numbers.ofThisMap(update.revision)) return;  // it refers to a map that was reset or replaced meanwhile
  if (frozen()) {
    // The plane module sends each change only once: keep those that it sent before it learnt of localisation-only mode.
    const bool says = !update.merges.empty() || !update.removed.empty() || !update.observations.empty() ||
                      !update.associated.empty() || !update.dissociated.empty();
    if (says) localisation.held_updates.push_back(update);
    return;
  }
  const ScopedTimer timer(log, "backend.planes", update.t);
  const auto attempt = [this](auto&& change) {
    try {
      change();
    } catch (const MapError& e) {
      report.refusals.add(e.what());
    }
  };
  for (const PlaneMerge& merge : update.merges) attempt([&] { map.mergePlanes(merge.from, merge.into); });
  for (const PlaneId id : update.removed) map.removePlane(id);
  for (const PlaneEstimate& plane : update.planes) attempt([&] { map.setPlane(plane); });
  removeUnnamedPlanes(update);
  for (const PlaneObservation& observation : update.observations) {
    if (map.setPlaneObservation(observation)) continue;
    const std::string bad = validateObservation(observation);
    if (!bad.empty()) report.refusals.add(bad);  // else its keyframe or plane is gone
  }
  for (const auto& pair : update.associated) {
    const LandmarkId id = map.resolve(pair.first);
    if (map.hasLandmark(id) && map.hasPlane(pair.second)) map.associate(id, pair.second);
  }
  for (const LandmarkId landmark : update.dissociated) {
    const LandmarkId id = map.resolve(landmark);
    if (map.hasLandmark(id)) map.associate(id, 0);
  }
}

// An update lists all planes. A plane that it does not list was removed or merged in an update that was lost.
void BackEnd::Impl::removeUnnamedPlanes(const PlaneUpdate& update) {
  std::set<PlaneId> named;
  for (const PlaneEstimate& plane : update.planes) named.insert(plane.id);
  std::vector<PlaneId> gone;
  for (const auto& entry : map.planes())
    if (!named.count(entry.first)) gone.push_back(entry.first);
  for (const PlaneId id : gone) map.removePlane(id);
}

void BackEnd::Impl::applyHeldUpdates() {
  std::vector<PlaneUpdate> held;
  held.swap(localisation.held_updates);
  for (const PlaneUpdate& update : held) applyPlaneUpdate(update);
}

}  // namespace vip_slam
