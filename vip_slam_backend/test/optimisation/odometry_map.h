// SPDX-License-Identifier: BSD-3-Clause
// A map before its first adjustment: simulated keyframes at the poses of their odometry, a landmark per track, planes.
#pragma once

#include <cmath>

#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// A landmark for each new track with depth, and the observations of known ones.
inline void observeTracks(KeyframeId id, Map* map) {
  const MapKeyframe& kf = map->keyframe(id);
  const SE3 T_W_C = kf.T_W_C();
  for (std::uint32_t k = 0; k < kf.features().size(); ++k) {
    const Feature& f = kf.features()[k];
    if (f.id == kNoLandmark) continue;
    if (map->hasLandmark(f.id))
      map->addObservation(f.id, {id, k});
    else if (f.depth > 0)
      map->addLandmark(f.id, T_W_C * (f.depth * f.xy.homogeneous()).cast<double>(), {id, k});
  }
}

/// The first `exact` keyframes are at their true poses; the odometry's drift begins there.
inline Map mapOfOdometry(SimulatedKeyframes* world, int keyframes, int exact_poses = 1) {
  Map map;
  SE3 T_true_odom;
  for (int k = 0; k < keyframes; ++k) {
    const KeyframePtr kf = world->next();
    const NavState truth = world->truth(kf->frame.t);
    NavState state = kf->frame.state;
    if (k < exact_poses) T_true_odom = truth.T_W_I * state.T_W_I.inverse();
    state.T_W_I = T_true_odom * state.T_W_I;
    state.v_W = T_true_odom.rotation() * state.v_W;
    map.addKeyframe(kf, state, ImuNoise());
    observeTracks(kf->id, &map);
    const PlaneUpdate planes = world->planes();
    for (const PlaneEstimate& plane : planes.planes) map.setPlane(plane);
    for (const PlaneObservation& observation : planes.observations) map.setPlaneObservation(observation);
    for (const auto& on_plane : planes.associated)
      if (map.hasLandmark(on_plane.first)) map.associate(on_plane.first, on_plane.second);
  }
  return map;
}

/// Root mean square of the keyframes' position errors, metres, without alignment.
inline double positionError(const Map& map, const SimulatedKeyframes& world) {
  double sum = 0;
  for (const auto& entry : map.keyframes()) {
    const MapKeyframe& kf = entry.second;
    sum += (kf.state.T_W_I.t() - world.truth(kf.data->frame.t).T_W_I.t()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(map.keyframes().size()));
}

}  // namespace vip_slam
