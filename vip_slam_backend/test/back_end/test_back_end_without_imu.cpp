// SPDX-License-Identifier: BSD-3-Clause
// The back end on keyframes of an RGB-D camera alone: they are tied by the odometry's motions, points and planes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "back_end/back_end_runs.h"

namespace vip_slam {
namespace {

TEST(BackEndWithoutImu, AllVariantsBeatTheOdometry) {
  for (const char* variant : {"vi", "vi_p", "vi_cp", "vip"}) {
    SimulatedKeyframes world(3);
    world.takeAwayImu();
    CheckedBackEnd back_end(options(variant), world.sensor());
    double odometry = 0, map = 0;
    for (int k = 0; k < 60; ++k) {
      const KeyframePtr kf = world.next();
      ASSERT_TRUE(kf->imu.empty());
      odometry += (kf->frame.state.T_W_I.t() - world.truth(kf->frame.t).T_W_I.t()).squaredNorm();
      back_end.addKeyframe(kf);
      ASSERT_EQ(back_end.lastRefusal(), "");
      back_end.applyPlaneUpdate(world.planes());
    }
    back_end.finish();
    EXPECT_TRUE(back_end.takeNotices().empty()) << "complains of an IMU that does not exist";
    const MapSnapshot snapshot = back_end.snapshot();
    ASSERT_EQ(snapshot.keyframes.size(), 60u);
    for (const SnapshotKeyframe& kf : snapshot.keyframes)
      map += (kf.state.T_W_I.t() - world.truth(kf.t).T_W_I.t()).squaredNorm();
    EXPECT_LT(std::sqrt(map), 0.5 * std::sqrt(odometry)) << variant;
    EXPECT_EQ(back_end.scale().sigma, 0) << "the scale of an IMU that does not exist";
  }
}

// Keyframes without IMU samples go as others do where a room is seen again and again, and the chain stays whole.
TEST(BackEndWithoutImu, KeyframesDoNotCrowd) {
  BackEndOptions o = options("vip");
  o.culling.above_covisible = 20;
  SimulatedKeyframes world(2, 300);
  world.takeAwayImu();
  CheckedBackEnd back_end(o, world.sensor());
  feed(&world, &back_end, 160);
  const auto& keyframes = back_end.map().keyframes();
  EXPECT_GT(keyframes.size(), 40u);
  EXPECT_LT(keyframes.size(), 100u);
  for (auto kf = std::next(keyframes.begin()); kf != keyframes.end(); ++kf) {
    EXPECT_EQ(kf->second.previous, std::prev(kf)->first);
    EXPECT_TRUE(kf->second.motion.known());
  }
}

TEST(BackEndWithoutImu, ItsMapIsSavedAndLoaded) {
  const std::string path = ::testing::TempDir() + "without_imu.vsm";
  SimulatedKeyframes world(4);
  world.takeAwayImu();
  CheckedBackEnd back_end(options("vip"), world.sensor()), again(options("vip"), world.sensor());
  feed(&world, &back_end, 20);
  back_end.saveMap(path);
  again.loadMap(path);
  std::remove(path.c_str());
  ASSERT_EQ(again.map().keyframes().size(), 20u);
  for (const auto& [id, kf] : again.map().keyframes()) {
    EXPECT_EQ(kf.imu, nullptr);
    EXPECT_EQ(kf.previous, id - 1);
    EXPECT_EQ(kf.motion.known(), id > 1);
    EXPECT_LT(kf.state.T_W_I.boxminus(back_end.map().keyframe(id).state.T_W_I).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace vip_slam
