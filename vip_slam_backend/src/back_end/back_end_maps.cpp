// SPDX-License-Identifier: BSD-3-Clause
// Stored maps within the back end: saving, loading, relocalisation in a loaded map, localisation without mapping.
#include <algorithm>
#include <map>
#include <set>

#include "back_end_impl.h"
#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/map_io/map_file.h"

namespace vip_slam {
namespace {

PlaneHost hostAt(const MapKeyframe& kf) { return {kf.id(), kf.data->frame.epoch, kf.state.T_W_I * kf.T_I_C}; }

}  // namespace

void BackEnd::Impl::saveMap(const std::string& path) const {
  saveMapFile(path, map, loop_closer.loops(), loop_closer.vocabulary().id(), sensor.camera);
}

MapUpdate BackEnd::Impl::loadMap(const std::string& path) {
  // Both throw before the back end is changed.
  StoredMap stored = loadMapFile(path, sensor.imu_noise, numbers.loadedLandmarks());
  requireCamera(stored, sensor.camera, path);
  numbers.loaded();
  reset();
  map = std::move(stored.map);
  loop_closer.rebuild(map, stored.loops);
  localisation.searching = !map.empty();
  if (localisation.searching) odometry.startIn(map);
  MapUpdate update = beginUpdate(0);
  fillGlobal(&update);
  finishUpdate(&update);
  return update;
}

std::vector<StoredPlane> BackEnd::Impl::storedPlanes() const {
  std::map<PlaneId, PlaneHost> hosts;
  for (const auto& [id, kf] : map.keyframes()) {  // in ascending order: the oldest first
    for (const auto& seen : kf.planes) hosts.try_emplace(seen.first, hostAt(kf));
  }
  // A plane without an observing keyframe is assigned to the reference part of the map.
  const std::set<KeyframeId> most = referencePart(map, loop_closer.loops());
  std::vector<StoredPlane> planes;
  for (const auto& [id, plane] : map.planes()) {
    const auto host = hosts.find(id);
    planes.push_back({plane.estimate, host == hosts.end() ? PlaneHost() : host->second});
    if (host == hosts.end() && !most.empty()) planes.back().host.epoch = map.keyframe(*most.begin()).data->frame.epoch;
  }
  return planes;
}

// Other parts of the map are not tied to the reference part: their place is a guess.
std::function<bool(KeyframeId)> BackEnd::Impl::inReferencePart() const {
  return [part = referencePart(map, loop_closer.loops())](KeyframeId id) { return part.count(id) != 0; };
}

bool BackEnd::Impl::findInMap(const KeyframePtr& keyframe, Relocalisation* found) {
  const ScopedTimer timer(log, "backend.relocalise", keyframe->frame.t);
  std::string reason;
  const auto result = relocaliser.relocalise(map, loop_closer, keyframe, inReferencePart(), &reason);
  LoopEvent event;
  event.query = keyframe->id;
  event.t = keyframe->frame.t;
  event.accepted = result.has_value();
  event.reason = "relocalisation: " + reason;
  if (result) {
    *found = *result;
    event.match = result->match;
    event.inliers = result->inliers;
    event.T_match_query = map.keyframe(result->match).state.T_W_I.inverse() * result->T_W_I;
  }
  report.loops.add(event);
  return result.has_value();
}

bool BackEnd::Impl::enterLoadedMap(const KeyframePtr& keyframe) {
  Relocalisation found;
  if (!findInMap(keyframe, &found)) {
    if (localisation.held.size() == kMaxWaitingKeyframes)
      return mapHeld();  // this keyframe is then inserted as any other
    localisation.held.push_back(keyframe);
    return false;
  }
  localisation.searching = false;
  odometry.place(keyframe->frame, found.T_W_I);
  // Keyframes from before the recognition are inserted as well, unless the odometry has restarted since.
  std::deque<KeyframePtr> before;
  before.swap(localisation.held);
  before.erase(std::remove_if(before.begin(), before.end(),
                              [&](const KeyframePtr& kf) {
                                return kf->frame.epoch != odometry.epoch() || kf->id >= keyframe->id;
                              }),
               before.end());
  insertHeld(before);
  odometry.place(keyframe->frame, found.T_W_I);
  insert(keyframe);
  loop_closer.tie(map, keyframe->id, found.match);
  fuseLandmarks(map, keyframe->id, found.landmarks);
  return true;
}

bool BackEnd::Impl::mapHeld() {
  if (!localisation.searching || localisation.held.empty() || frozen()) return false;
  localisation.searching = false;
  std::deque<KeyframePtr> unplaced;
  unplaced.swap(localisation.held);
  insertHeld(unplaced);
  return true;
}

void BackEnd::Impl::insertHeld(const std::deque<KeyframePtr>& keyframes) {
  for (const KeyframePtr& kf : keyframes) {
    try {
      insert(kf);
    } catch (const MapError& e) {  // the others are inserted nevertheless
      report.refused(e.what());
      continue;
    }
    loop_closer.add(map, kf->id);
    global.want();  // most of them lie beyond the local window
  }
}

void BackEnd::Impl::localise(const KeyframePtr& keyframe) {
  const bool known = !localisation.searching && keyframe->frame.epoch == odometry.epoch();
  std::optional<Relocalisation> found;
  const SE3 predicted = odometry.T_map_odom() * keyframe->frame.state.T_W_I;
  if (known) found = relocaliser.track(map, loop_closer, *keyframe, predicted, inReferencePart());
  Relocalisation place;
  if (!found && findInMap(keyframe, &place)) found = place;
  if (!found) {
    // From here on the odometry drifts: its place is still good enough for a pose, but not to join two parts of the
    // map.
    if (localisation.last_found) localisation.last_found->newest = false;
    return;
  }
  localisation.searching = false;
  odometry.place(keyframe->frame, found->T_W_I);
  localisation.localised.push_back({keyframe->frame.t, odometry.epoch(), keyframe->frame.T_chain_C,
                                    odometry.T_map_odom() * keyframe->frame.state.T_W_I, keyframe->frame.T_I_C});
  localisation.last_found = Localisation::LastFound{odometry.epoch(), found->match, keyframe->frame.t};
}

bool BackEnd::Impl::hasRecentLocalisation(const Keyframe& keyframe) {
  if (!localisation.last_found) return false;
  if (keyframe.frame.epoch != localisation.last_found->epoch) {
    localisation.last_found.reset();
    return false;
  }
  return localisation.last_found->newest && map.hasKeyframe(localisation.last_found->match);
}

bool BackEnd::Impl::moveUnplacedPartToMap(std::uint32_t of_epoch) {
  KeyframeId newest = 0;
  for (const auto& [id, kf] : map.keyframes())
    if (kf.data->frame.epoch == of_epoch) newest = id;
  if (newest == 0) return false;
  const std::set<KeyframeId> part = connectedKeyframes(map, newest, loop_closer.loops());
  if (part.count(localisation.last_found->match)) return false;
  const MapKeyframe& last = map.keyframe(newest);
  const SE3 move = alignLevelled(odometry.T_map_odom() * last.data->frame.state.T_W_I, last.state.T_W_I);
  std::map<KeyframeId, SE3> moved;
  std::set<PlaneId> planes;
  for (const KeyframeId id : part) {
    const MapKeyframe& kf = map.keyframe(id);
    moved[id] = move * kf.state.T_W_I;
    for (const auto& seen : kf.planes) planes.insert(seen.first);
  }
  map.moveKeyframes(moved);
  for (const PlaneId id : planes) map.movePlane(id, move);
  global.outdate();  // an adjustment under way has it at its old place
  global.want();
  return true;
}

void BackEnd::Impl::tieToLastFound(const KeyframePtr& keyframe) {
  loop_closer.tie(map, keyframe->id, localisation.last_found->match);
  localisation.last_found.reset();
}

}  // namespace vip_slam
