// SPDX-License-Identifier: BSD-3-Clause
// The back end on simulated keyframes: accuracy, invariants after every operation, all variants.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "back_end/back_end_runs.h"
#include "vip_slam_backend/map/culling.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/optimisation/global_ba.h"

using namespace vip_slam;

// Many rounds in one room, where all keyframes see the same: only as many stay as are needed.
TEST(BackEnd, KeyframesDoNotCrowd) {
  BackEndOptions crowded = options("vip"), thinned = crowded;
  crowded.culling.enabled = false;
  thinned.culling.above_covisible = 20;
  const RunResult all = run(crowded, 160, 2, 300), few = run(thinned, 160, 2, 300);
  EXPECT_EQ(all.snapshot.keyframes.size(), 160u);
  EXPECT_GT(few.snapshot.keyframes.size(), 40u);
  EXPECT_LT(few.snapshot.keyframes.size(), 100u);
  EXPECT_LT(few.rmse, 1.5 * all.rmse + 0.002);
  // The kept keyframes are spread over the whole time.
  double last = few.snapshot.keyframes.front().t, widest = last;
  for (const SnapshotKeyframe& kf : few.snapshot.keyframes) widest = std::max(widest, kf.t - std::exchange(last, kf.t));
  EXPECT_LT(widest, 30.0);
}

// In a room that is revisited many times all keyframes are ends of loops. Only loops that tie two odometries protect
// their keyframes, as far as these need them.
TEST(BackEnd, EndsOfLoopsCrowdOnlyWhereTheyTieParts) {
  BackEndOptions o = options("vip");
  o.culling.enabled = false;
  SimulatedKeyframes world(2, 300);
  CheckedBackEnd back_end(o, world.sensor());
  feed(&world, &back_end, 90);
  CullingOptions culling;
  culling.above_covisible = 20;
  std::vector<KeyframeId> thinned;  // of one odometry
  for (const bool two_odometries : {false, true}) {
    Map map = back_end.map();
    for (KeyframeId id = 1; id <= 90; ++id) map.keyframe(id).loop_keyframe = true;
    // The keyframes that could be culled are the ends of loops.
    std::vector<std::pair<KeyframeId, KeyframeId>> loops;
    for (const KeyframeId id : thinned) loops.emplace_back(90, id);
    if (two_odometries) {
      auto other = std::make_shared<Keyframe>(*map.keyframe(90).data);
      other->frame.epoch = 7;
      MapKeyframe& last = map.keyframe(90);
      map.keyframe(89).next = last.previous = 0;
      last.data = other;
      last.imu = nullptr;
      last.preintegration = nullptr;
      last.motion = RelativeMotion();
    }
    std::vector<KeyframeId> removed;
    for (int k = 0; k < 40; ++k)
      for (const KeyframeId id : cullKeyframes(culling, 20, ImuNoise(), loops, &map)) removed.push_back(id);
    EXPECT_EQ(checkMap(map), "");
    EXPECT_FALSE(removed.empty());
    if (two_odometries) EXPECT_TRUE(map.hasKeyframe(thinned.front())) << thinned.front();  // the oldest ties them
    thinned = removed;
  }
}
TEST(BackEnd, ARequestOutlivesAResultThatComesTooLate) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 4; ++k) back_end.addKeyframe(world.next());
  back_end.requestGlobalBa();
  GbaResult of_nothing;
  of_nothing.correction = 1000;
  back_end.merge(of_nothing);
  EXPECT_TRUE(back_end.globalBaWanted());
}

// Also when a stored map has a keyframe with the same id as its predecessor.
TEST(BackEnd, ANewOdometryBringsItsOwnBiases) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 6; ++k) back_end.addKeyframe(world.next());
  auto anew = std::make_shared<Keyframe>(*world.next());
  anew->frame.epoch = 1;
  anew->frame.features.clear();
  anew->frame.state.bias_gyro = Eigen::Vector3d(0.05, -0.02, 0.01);
  back_end.addKeyframe(anew);
  ASSERT_EQ(back_end.lastRefusal(), "");
  EXPECT_LT((back_end.map().keyframe(7).state.bias_gyro - anew->frame.state.bias_gyro).norm(), 1e-6);
}

TEST(BackEnd, AllVariantsBeatTheOdometry) {
  for (const char* variant : {"vi", "vi_p", "vi_cp", "vip"}) {
    const RunResult result = run(variant, variant == std::string("vi_p") ? 20 : 45);
    EXPECT_LT(result.rmse, 0.01) << variant;
    EXPECT_LT(result.rmse, 0.5 * result.odometry_rmse) << variant;
    EXPECT_GT(result.snapshot.landmarks.size(), 50u) << variant;
    RecordProperty(variant, std::to_string(result.rmse));
    std::printf(
        "%s: rmse %.4f m, odometry %.4f m, %zu keyframes, %zu landmarks, reobserved %lu merged %lu outliers %lu\n",
        variant, result.rmse, result.odometry_rmse, result.snapshot.keyframes.size(), result.snapshot.landmarks.size(),
        static_cast<unsigned long>(result.snapshot.statistics.reobserved),
        static_cast<unsigned long>(result.snapshot.statistics.merged),
        static_cast<unsigned long>(result.snapshot.statistics.outliers));
  }
}

// Where few landmarks are shared by successive keyframes, the odometry adds information from the images in between.
TEST(BackEnd, OdometryHoldsWhereLandmarksAreFew) {
  double with = 0, without = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    BackEndOptions o = options("vi");
    with += run(o, 40, seed, 8).rmse;
    o.measurement.use_odometry = false;
    without += run(o, 40, seed, 8).rmse;
  }
  std::printf("mean rmse of four seeds: %.4f m, without odometry %.4f m\n", with / 4, without / 4);
  EXPECT_LT(with, 0.7 * without);
}

TEST(BackEnd, TwoRunsGiveTheSameBits) {
  const RunResult a = run("vip", 15), b = run("vip", 15);
  ASSERT_EQ(a.snapshot.keyframes.size(), b.snapshot.keyframes.size());
  for (std::size_t k = 0; k < a.snapshot.keyframes.size(); ++k)
    EXPECT_EQ(a.snapshot.keyframes[k].state.T_W_I.matrix(), b.snapshot.keyframes[k].state.T_W_I.matrix());
}

// A machine too slow for a single step: the map follows the odometry and loses nothing. In lockstep time does not
// count.
TEST(BackEnd, WithoutTimeTheOdometryStays) {
  BackEndOptions o = options("vip");
  o.global_ba.at_end = false;
  const RunResult unlimited = run(o, 25, 2, 300);
  o.local_ba.max_seconds = 1e-9;
  const RunResult lockstep = run(o, 25, 2, 300);
  o.lockstep = false;
  const RunResult late = run(o, 25, 2, 300);
  EXPECT_EQ(lockstep.rmse, unlimited.rmse);
  EXPECT_LT(unlimited.rmse, 0.5 * unlimited.odometry_rmse);
  EXPECT_NEAR(late.rmse, late.odometry_rmse, 1e-9);
  EXPECT_EQ(late.snapshot.statistics.outliers, 0u);
}

TEST(BackEnd, CeresRunsTheSameSystem) {
  const RunResult a = run("vip", 12), b = run("vip", 12, 1, "ceres");
  EXPECT_NEAR(a.rmse, b.rmse, 2e-3);
}

TEST(BackEnd, GlobalAdjustmentMergesWithWhatCameMeanwhile) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 15);
  back_end.requestGlobalBa();
  EXPECT_TRUE(back_end.globalBaWanted());
  const GbaJob job = back_end.startGlobalBa();
  EXPECT_FALSE(back_end.globalBaWanted());
  feed(&world, &back_end, 5);
  const MapUpdate update = back_end.merge(back_end.run(job));
  EXPECT_TRUE(update.global);
  EXPECT_EQ(update.keyframes.size(), back_end.map().keyframes().size());
  for (const KeyframeEstimate& kf : update.keyframes)
    EXPECT_LT((kf.state.T_W_I.t() - world.truth((kf.id - 1) * world.interval()).T_W_I.t()).norm(), 0.03);
  // map -> odom carries the newest keyframe.
  const MapKeyframe& newest = back_end.map().keyframe(update.newest_keyframe);
  EXPECT_LT((update.T_map_odom * newest.data->frame.state.T_W_I).boxminus(newest.state.T_W_I).norm(), 1e-9);
}

// What the global adjustment takes for an outlier in its copy does not stay in the map.
TEST(BackEnd, GlobalAdjustmentRemovesOutliers) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 15);
  Map map = back_end.map();
  MapKeyframe& old = map.keyframe(4);
  auto spoilt = std::make_shared<Keyframe>(*old.data);
  std::vector<std::size_t> spoilt_features;
  for (std::size_t f = 0; f < old.landmarks.size() && spoilt_features.size() < 3; ++f) {
    if (old.landmarks[f] == kNoLandmark || map.landmark(old.landmarks[f]).observations.size() < 4) continue;
    spoilt->frame.features[f].xy.x() += 0.1f;  // 50 px
    spoilt_features.push_back(f);
  }
  ASSERT_EQ(spoilt_features.size(), 3u);
  old.data = spoilt;
  GlobalBaProblem job;
  job.map = std::make_shared<const Map>(map);
  job.settings.focal = world.sensor().camera.fx;
  job.solver = "structured";
  job.noise = world.sensor().imu_noise;
  const GlobalBaSolution solution = solveGlobalBa(job);
  ASSERT_TRUE(solution.summary.usable);
  EXPECT_GE(solution.outliers.size(), 3u);
  map.removeLandmark(old.landmarks[spoilt_features[2]]);  // removed meanwhile
  mergeGlobalBa(solution, job.noise, &map);
  EXPECT_EQ(checkMap(map), "");
  for (const std::size_t f : spoilt_features) EXPECT_EQ(map.keyframe(4).landmarks[f], kNoLandmark);
}
