// SPDX-License-Identifier: BSD-3-Clause
// Feeds simulated keyframes to a back end, checks its map after every operation and returns the final error.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "back_end/checked_back_end.h"
#include "back_end/simulated_keyframes.h"

namespace vip_slam {

inline BackEndOptions options(const std::string& variant) {
  BackEndOptions o;
  o.variant = variant;
  o.loop_closing = false;
  o.lockstep = true;
  return o;
}

/// The part of the map that an odometry belongs to, as the update has it.
inline std::uint32_t partOf(const MapUpdate& update, std::uint32_t epoch) {
  for (const EpochPart& told : update.parts)
    if (told.epoch == epoch) return told.part;
  ADD_FAILURE() << "nothing told of epoch " << epoch;
  return 0;
}

/// Keyframes and the plane module's answer to each.
inline void feed(SimulatedKeyframes* world, BackEnd* back_end, int keyframes) {
  for (int k = 0; k < keyframes; ++k) {
    const MapUpdate update = back_end->addKeyframe(world->next());
    ASSERT_EQ(checkMap(back_end->map()), "") << "after keyframe " << update.newest_keyframe;
    back_end->applyPlaneUpdate(world->planes());
    ASSERT_EQ(checkMap(back_end->map()), "") << "after the planes of keyframe " << update.newest_keyframe;
  }
}

struct RunResult {
  double rmse = 0, odometry_rmse = 0;
  MapSnapshot snapshot;
};

inline RunResult run(const BackEndOptions& o, int keyframes, unsigned seed, int points) {
  SimulatedKeyframes world(seed, points);
  CheckedBackEnd back_end(o, world.sensor());
  std::map<KeyframeId, double> odometry_error;
  for (int k = 0; k < keyframes; ++k) {
    const KeyframePtr kf = world.next();
    odometry_error[kf->id] = (kf->frame.state.T_W_I.t() - world.truth(kf->frame.t).T_W_I.t()).squaredNorm();
    const MapUpdate update = back_end.addKeyframe(kf);
    EXPECT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(update.newest_keyframe, kf->id);
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.finish();
  RunResult result;
  result.snapshot = back_end.snapshot();
  for (const SnapshotKeyframe& kf : result.snapshot.keyframes) {
    result.rmse += (kf.state.T_W_I.t() - world.truth(kf.t).T_W_I.t()).squaredNorm();
    result.odometry_rmse += odometry_error[kf.id];
  }
  result.rmse = std::sqrt(result.rmse / result.snapshot.keyframes.size());
  result.odometry_rmse = std::sqrt(result.odometry_rmse / result.snapshot.keyframes.size());
  return result;
}

inline RunResult run(const std::string& variant, int keyframes, unsigned seed = 1,
                     const std::string& solver = "structured") {
  BackEndOptions o = options(variant);
  o.solver = solver;
  return run(o, keyframes, seed, 500);
}

}  // namespace vip_slam
