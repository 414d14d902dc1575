// SPDX-License-Identifier: BSD-3-Clause
// Localisation in a loaded map, mapping after it, and what is not placed yet.
#include <gtest/gtest.h>

#include <optional>

#include "back_end/back_end_runs.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map_io/map_file.h"

using namespace vip_slam;

TEST(BackEndLocalisation, LocalisationWithoutAMapMapsNothing) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  back_end.setLocalisationMode(true);
  for (int k = 0; k < 3; ++k) {
    const KeyframePtr keyframe = world.next();
    const MapUpdate update = back_end.addKeyframe(keyframe);
    EXPECT_EQ(update.newest_keyframe, 0u);
    EXPECT_EQ(update.removed_keyframes, std::vector<KeyframeId>{keyframe->id});  // else the planes would wait for it
    EXPECT_NE(back_end.lastRefusal().find("localisation without a map"), std::string::npos) << back_end.lastRefusal();
  }
  EXPECT_TRUE(back_end.map().empty());
  back_end.setLocalisationMode(false);
  back_end.addKeyframe(world.next());
  EXPECT_EQ(back_end.lastRefusal(), "");
  EXPECT_EQ(back_end.map().keyframes().size(), 1u);
}

TEST(BackEndLocalisation, NothingChangesAMapThatIsOnlyLocalisedIn) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 8; ++k) back_end.addKeyframe(world.next());
  const GbaResult late = back_end.run(back_end.startGlobalBa());
  ASSERT_TRUE(late.solution);
  back_end.setLocalisationMode(true);
  const SE3 before = back_end.map().keyframe(3).state.T_W_I;
  EXPECT_FALSE(back_end.merge(late).global);
  EXPECT_EQ(back_end.map().keyframe(3).state.T_W_I.boxminus(before).norm(), 0.0);
  back_end.requestGlobalBa();
  EXPECT_FALSE(back_end.globalBaWanted());
  // A keyframe in transit while the map was loaded has an id that the map uses too.
  SimulatedKeyframes other(9);
  const MapUpdate update = back_end.addKeyframe(other.next());
  EXPECT_TRUE(update.removed_keyframes.empty());
  EXPECT_NE(back_end.lastRefusal().find("not newer"), std::string::npos) << back_end.lastRefusal();
  back_end.setLocalisationMode(false);
  EXPECT_TRUE(back_end.globalBaWanted());
}

// Hours in a place that is not mapped: refused keyframes are not kept for ever.
TEST(BackEndLocalisation, LookingInVainForLongKeepsTheNewestRefusalsOnly) {
  SimulatedKeyframes world(3), other(9);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 8);
  back_end.setLocalisationMode(true);
  for (int k = 0; k < 8; ++k) other.next();  // their ids are used by the map
  std::size_t refused = 0;
  KeyframeId last = 0;
  for (int k = 0; k < 1200; ++k) {
    const KeyframePtr keyframe = other.next();
    last = keyframe->id;
    for (const LoopEvent& event : back_end.addKeyframe(keyframe).loops) refused += !event.accepted;
  }
  ASSERT_GT(refused, 1050u);
  const std::vector<LoopEvent> kept = back_end.snapshot().loops;
  EXPECT_LE(kept.size(), 1000 + (1200 - refused));
  ASSERT_FALSE(kept.empty());
  EXPECT_EQ(kept.back().query, last);
}

TEST(BackEndLocalisation, LocalisationOnlyTellsWhereTheOdometryLiesInTheMap) {
  const std::string path = ::testing::TempDir() + "localisation_only.vsm";
  SimulatedKeyframes world(4), session(4);
  CheckedBackEnd mapper(options("vip"), world.sensor()), back_end(options("vip"), world.sensor());
  feed(&world, &mapper, 25);
  mapper.finish();
  mapper.saveMap(path);

  back_end.loadMap(path);
  back_end.setLocalisationMode(true);
  EXPECT_TRUE(back_end.snapshot().localised.empty());
  // The same walk in an odometry with another origin and heading.
  const SE3 T_other_odom(Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {7, -3, 1});
  std::vector<ChainedPose> chain;
  for (int k = 0; k < 25; ++k) {
    auto kf = std::make_shared<Keyframe>(*session.next());
    kf->id += 1000;
    kf->previous = kf->id - 1;
    kf->frame.state.T_W_I = T_other_odom * kf->frame.state.T_W_I;
    kf->frame.T_chain_C = T_other_odom * kf->frame.T_chain_C;
    chain.push_back({kf->frame.t, kf->frame.epoch, kf->frame.T_chain_C});
    back_end.addKeyframe(kf);
  }
  back_end.finish();
  const MapSnapshot snapshot = back_end.snapshot();
  EXPECT_EQ(snapshot.keyframes.size(), mapper.snapshot().keyframes.size());
  ASSERT_GT(snapshot.localised.size(), 15u);
  const Trajectory trajectory = anchorTrajectory(chain, anchorsOf(snapshot));
  ASSERT_EQ(trajectory.size(), chain.size());
  for (const auto& pose : trajectory)
    EXPECT_LT((pose.T_W_B.t() - world.truth(pose.t).T_W_I.t()).norm(), 0.03) << "at " << pose.t;
  back_end.reset();
  EXPECT_TRUE(back_end.snapshot().localised.empty());
}

TEST(BackEndLocalisation, APartThatNothingTiesToTheMapIsNeitherPlacedNorLocalisedIn) {
  SimulatedKeyframes world(4), again(4), other(9), other_again(9);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  const auto anew = [&back_end](SimulatedKeyframes* place, std::uint32_t epoch, int count) {
    MapUpdate update;
    for (int k = 0; k < count; ++k) {
      auto kf = std::make_shared<Keyframe>(*place->next());
      kf->id += 1000 * epoch;
      kf->previous = k == 0 ? 0 : kf->id - 1;
      kf->frame.epoch = epoch;
      for (Feature& f : kf->frame.features) f.id += 1000000 * LandmarkId(epoch);
      update = back_end.addKeyframe(kf);
      EXPECT_EQ(back_end.lastRefusal(), "");
    }
    return update;
  };
  EXPECT_TRUE(anew(&world, 0, 25).placed);
  const MapUpdate lost = anew(&other, 1, 15);
  EXPECT_EQ(lost.epoch, 1u);
  EXPECT_FALSE(lost.placed);
  const auto guessed = guessedTimes(back_end.snapshot());
  ASSERT_EQ(guessed.size(), 1u);
  EXPECT_EQ(guessed.front().first, back_end.map().keyframe(1001).data->frame.t);
  EXPECT_EQ(guessed.front().second, lost.t);
  back_end.setLocalisationMode(true);
  EXPECT_FALSE(anew(&other_again, 2, 15).placed);
  EXPECT_TRUE(back_end.snapshot().localised.empty());
  EXPECT_TRUE(anew(&again, 3, 25).placed);
  EXPECT_FALSE(back_end.snapshot().localised.empty());
}

TEST(BackEndLocalisation, MappingAfterLocalisationIsTiedToTheMap) {
  const std::string path = ::testing::TempDir() + "mapped_on.vsm";
  SimulatedKeyframes world(4);
  CheckedBackEnd mapper(options("vip"), world.sensor());
  feed(&world, &mapper, 25);
  mapper.saveMap(path);
  for (const bool lost : {false, true}) {  // the last keyframe before that was not found in the map
    SimulatedKeyframes session(4);
    CheckedBackEnd back_end(options("vip"), world.sensor());
    back_end.loadMap(path);
    back_end.setLocalisationMode(true);
    for (int k = 0; k < 20; ++k) {
      auto kf = std::make_shared<Keyframe>(*session.next());
      kf->id += 1000;
      kf->previous = k == 0 ? 0 : kf->id - 1;
      kf->frame.epoch = 7;
      if (k == 18) {
        ASSERT_GT(back_end.snapshot().localised.size(), 10u);
        back_end.setLocalisationMode(false);
      }
      if (lost && k == 17) kf->frame.features.clear();
      const MapUpdate update = back_end.addKeyframe(kf);
      if (k >= 18) {
        EXPECT_TRUE(update.placed);  // the odometry continued throughout
        EXPECT_EQ(update.epoch, 7u);
        EXPECT_EQ(partOf(update, 7) == partOf(update, kLoadedEpochs), !lost) << k;
      }
      EXPECT_EQ(back_end.lastRefusal(), "");
    }
    EXPECT_EQ(back_end.map().keyframe(1019).loop_keyframe, !lost);
    EXPECT_FALSE(back_end.map().keyframe(1020).loop_keyframe);
    bool meets = false;
    for (const auto& [id, shared] : back_end.map().covisible(1020)) meets = meets || id <= 25;
    EXPECT_EQ(meets, !lost);
  }
}

// After tracking loss four keyframes are mapped at a guessed pose; then the place is recognised, and mapping goes on.
TEST(BackEndLocalisation, WhatWasMappedAtAGuessComesAlongWhenItsOdometryIsFound) {
  SimulatedKeyframes world(4), session(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 25);
  const SE3 T_other_odom(Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {7, -3, 1});
  MapUpdate update;
  for (int k = 0; k < 18; ++k) {
    auto kf = std::make_shared<Keyframe>(*session.next());
    kf->id += 1000;
    kf->previous = k == 0 ? 0 : kf->id - 1;
    kf->frame.epoch = 7;
    kf->frame.state.T_W_I = T_other_odom * kf->frame.state.T_W_I;
    kf->frame.state.v_W = T_other_odom.rotation() * kf->frame.state.v_W;
    for (Feature& f : kf->frame.features) {
      f.id += 1000000;
      if (k < 4) f.descriptor.fill(0x55);  // nothing looks as it did
    }
    if (k == 4) back_end.setLocalisationMode(true);
    if (k == 16) {
      ASSERT_GT(back_end.snapshot().localised.size(), 3u);
      back_end.setLocalisationMode(false);
    }
    update = back_end.addKeyframe(kf);
    EXPECT_EQ(back_end.lastRefusal(), "");
    if (k == 16) EXPECT_TRUE(update.global);
  }
  EXPECT_TRUE(update.placed);
  EXPECT_EQ(partOf(update, 7), partOf(update, 0));
  const auto error = [&](KeyframeId id) {
    const MapKeyframe& kf = back_end.map().keyframe(id);
    return (kf.state.T_W_I.t() - world.truth(kf.data->frame.t).T_W_I.t()).norm();
  };
  for (const KeyframeId id : {1001, 1004, 1017, 1018}) EXPECT_LT(error(id), 0.05) << id;
}

// The odometry has drifted by 0.5 m since its last keyframe in the map; an adjustment finishes before the next one.
TEST(BackEndLocalisation, AnAdjustmentLeavesTheOdometryWhereItWasFound) {
  SimulatedKeyframes world(4), again(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 25);
  const SE3 drift(Eigen::Quaterniond::Identity(), {0.5, 0.2, 0});
  SE3 found;
  back_end.setLocalisationMode(true);
  for (int k = 0; k < 12; ++k) {
    auto kf = std::make_shared<Keyframe>(*again.next());
    kf->id += 1000;
    kf->previous = kf->id - 1;
    kf->frame.t += 100;
    kf->imu.clear();
    kf->frame.state.T_W_I = drift * kf->frame.state.T_W_I;
    for (Feature& f : kf->frame.features) f.id += 1000000;
    found = back_end.addKeyframe(kf).T_map_odom;
  }
  ASSERT_GT(back_end.snapshot().localised.size(), 3u);
  ASSERT_LT((found * drift).t().norm(), 0.1);
  back_end.setLocalisationMode(false);
  back_end.requestGlobalBa();
  const MapUpdate update = back_end.merge(back_end.run(back_end.startGlobalBa()));
  EXPECT_TRUE(update.global);
  EXPECT_LT((update.T_map_odom.t() - found.t()).norm(), 0.05);
}
