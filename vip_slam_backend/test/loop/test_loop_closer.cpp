// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "loop/ring_world.h"
#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/relocalisation/relocaliser.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

/// All keyframes in order, as the back end would do it.
std::vector<LoopEvent> closeAll(LoopCloser& closer, Map& map) {
  std::vector<KeyframeId> ids;
  for (const auto& entry : map.keyframes()) ids.push_back(entry.first);
  std::vector<LoopEvent> accepted;
  for (const KeyframeId id : ids) {
    closer.add(map, id);
    for (const LoopEvent& event : closer.close(map, id))
      if (event.accepted) {
        accepted.push_back(event);
        EXPECT_EQ(checkMap(map), "") << "after the loop from keyframe " << id;
      }
  }
  return accepted;
}

TEST(LoopCloser, ClosesTheRingAndRemovesTheDrift) {
  RingWorld world;
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 1.15, 0.4, &truth);
  LoopCloser closer(LoopOptions(), world.camera());
  const KeyframeId last = map.newestKeyframe();
  const double before = (map.keyframe(last).state.T_W_I.t() - truth.back().t()).norm();
  const std::size_t landmarks = map.landmarks().size();
  const auto loops = closeAll(closer, map);
  ASSERT_FALSE(loops.empty());
  EXPECT_EQ(checkMap(map), "");
  EXPECT_GT(before, 0.1);
  EXPECT_LT((map.keyframe(last).state.T_W_I.t() - truth.back().t()).norm(), 0.05);
  EXPECT_LT(map.landmarks().size(), landmarks - 100);  // the second round's points were merged with the first's
  for (const LoopEvent& loop : loops) {
    const SE3 found = loop.T_match_query, right = truth[loop.match - 1].inverse() * truth[loop.query - 1];
    EXPECT_LT((found.t() - right.t()).norm(), 0.03) << loop.query << " -> " << loop.match;
  }
  // Removing a keyframe from the map removes its loops.
  const std::size_t all = closer.loops().size();
  closer.remove(loops[0].query);
  EXPECT_LT(closer.loops().size(), all);
  for (const auto& [query, match] : closer.loops()) EXPECT_TRUE(query != loops[0].query && match != loops[0].query);
}

TEST(LoopCloser, APlaneThatNoKeyframeObservesStaysThePlaneModules) {
  RingWorld world;
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 1.15, 0.4, &truth);
  PlaneEstimate plane;
  plane.id = 1000;
  plane.plane = Plane({0, 0, 1}, -0.7);
  map.setPlane(plane);
  LoopCloser closer(LoopOptions(), world.camera());
  ASSERT_FALSE(closeAll(closer, map).empty());
  EXPECT_FALSE(map.planes().at(1000).optimised);
  plane.plane.d = -0.8;
  map.setPlane(plane);
  EXPECT_EQ(-0.8, map.planes().at(1000).estimate.plane.d);
}

TEST(LoopCloser, ALittleTiltMattersNoMoreFarFromTheOrigin) {
  std::vector<std::size_t> closed;
  for (const double away : {0.0, 100.0}) {
    RingWorld world;
    Map map;
    std::vector<SE3> truth;
    world.walk(map, 1.1, 0.1, &truth, Eigen::Vector3d(away, 0, 0), 0.2 * kDegree);
    world.addFloors(map, truth, 60);
    LoopCloser closer(LoopOptions(), world.camera());
    const auto loops = closeAll(closer, map);
    ASSERT_FALSE(loops.empty()) << away << " m away";
    EXPECT_NE(loops.back().reason.find("1 planes agree"), std::string::npos) << loops.back().reason;
    EXPECT_EQ(checkMap(map), "");
    closed.push_back(loops.size());
  }
  EXPECT_EQ(closed[0], closed[1]);
}

// Inliers from where the map shows nothing of the image prove no place: nothing can tell how many there should be.
TEST(LoopCloser, APlaceOfWhichTheMapShowsNothingIsNoPlace) {
  RingWorld world;
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 1.15, 0.05, &truth);
  for (const auto& entry : std::map<KeyframeId, MapKeyframe>(map.keyframes().begin(), map.keyframes().end())) {
    auto blind = std::make_shared<Keyframe>(*entry.second.data);
    for (Feature& feature : blind->frame.features) feature.depth = 0;
    map.keyframe(entry.first).data = blind;
  }
  LoopCloser closer(LoopOptions(), world.camera());
  EXPECT_TRUE(closeAll(closer, map).empty());
}

TEST(LoopCloser, NothingToCloseOnAWayWithoutReturn) {
  RingWorld world;
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 0.8, 0.1, &truth);
  LoopCloser closer(LoopOptions(), world.camera());
  const SE3 before = map.keyframe(60).state.T_W_I;
  EXPECT_TRUE(closeAll(closer, map).empty());
  EXPECT_EQ(map.keyframe(60).state.T_W_I.matrix(), before.matrix());
}

TEST(LoopCloser, IdenticalBaysMakeNoLoop) {
  // Six bays that look exactly alike, five metres apart: only odometry distinguishes them.
  RingWorld world(6);
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 0.9, 0.1, &truth);
  LoopCloser closer(LoopOptions(), world.camera());
  const auto loops = closeAll(closer, map);
  EXPECT_TRUE(loops.empty()) << loops.size() << " wrong loops, first " << loops.front().query << " -> "
                             << loops.front().match << ": " << loops.front().reason;
}

/// A walk of `count` keyframes round the ring, `step` radians each, in a separate odometry whose pose in the map is
/// `guess` until a loop is found. Returns the id of the last keyframe.
KeyframeId walkAnew(RingWorld& world, LoopCloser& closer, Map& map, KeyframeId first, std::uint32_t epoch, double from,
                    double step, int count, const SE3& guess) {
  KeyframeId previous = 0;
  SE3 T_map_odom;
  for (int k = 0; k < count; ++k) {
    const KeyframeId id = first + static_cast<KeyframeId>(k);
    const SE3 T = world.truth(from + step * k);
    const LandmarkId tracks = 1000000 * LandmarkId(epoch);
    auto kf = std::make_shared<Keyframe>(*world.see(id, 0.5 * static_cast<double>(id), T, guess * T, tracks));
    kf->frame.epoch = epoch;
    kf->previous = previous;
    previous = kf->id;
    NavState state = kf->frame.state;
    state.T_W_I = T_map_odom * guess * T;
    map.addKeyframe(kf, state, ImuNoise());
    world.addLandmarks(map, *kf);
    closer.add(map, kf->id);
    closer.close(map, kf->id);
    EXPECT_EQ(checkMap(map), "") << "after keyframe " << kf->id;
    T_map_odom = map.keyframe(kf->id).state.T_W_I * (guess * T).inverse();
  }
  return previous;
}

/// A wrong guess of the pose, as after the camera was carried while covered.
SE3 guessOf(double yaw) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(3, -4, 0.5));
}

TEST(LoopCloser, OdometryThatBeganAnewJoinsWhereOnlyOnePlaceFits) {
  for (const int bays : {1, 6}) {
    RingWorld world(bays);
    Map map;
    std::vector<SE3> truth;
    world.walk(map, 0.9, 0.0, &truth);
    LoopCloser closer(LoopOptions(), world.camera());
    closeAll(closer, map);
    const SE3 guess = guessOf(2.0);
    const KeyframeId previous = walkAnew(world, closer, map, 1000, 1, 1.0, 0.05, 12, guess);
    EXPECT_EQ(checkMap(map), "");
    EXPECT_EQ(closer.tied(map, previous), bays == 1);
    if (bays == 1) {
      EXPECT_LT((map.keyframe(1000).state.T_W_I.t() - world.truth(1.0).t()).norm(), 0.05);
      EXPECT_LT((map.keyframe(previous).state.T_W_I.t() - world.truth(1.55).t()).norm(), 0.05);
    } else {
      EXPECT_LT((map.keyframe(previous).state.T_W_I.t() - (guess * world.truth(1.55)).t()).norm(), 1e-9);
    }
  }
}

// A fragment that was mapped after tracking loss and never tied to the map is moved to the map, not the map to it.
TEST(LoopCloser, TheMapStaysWhenAFragmentIsFoundAgain) {
  RingWorld world(1);
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 0.35, 0.0, &truth);
  LoopCloser closer(LoopOptions(), world.camera());
  closeAll(closer, map);
  const SE3 first = map.keyframe(1).state.T_W_I;
  walkAnew(world, closer, map, 1000, 1, 2.9, 0.07, 8, guessOf(2.0));  // a place that is not mapped
  EXPECT_GT((map.keyframe(1000).state.T_W_I.t() - world.truth(2.9).t()).norm(), 1.0);
  EXPECT_EQ(0u, referencePart(map, closer.loops()).count(1000));
  walkAnew(world, closer, map, 2000, 2, 1.2, 0.07, 32, guessOf(-1.0));  // starts in the map and goes on to that place
  EXPECT_LT((map.keyframe(1).state.T_W_I.t() - first.t()).norm(), 0.05);
  EXPECT_LT((map.keyframe(2000).state.T_W_I.t() - world.truth(1.2).t()).norm(), 0.1);
  EXPECT_TRUE(closer.tied(map, 1000));
  EXPECT_LT((map.keyframe(1000).state.T_W_I.t() - world.truth(2.9).t()).norm(), 0.1);
  EXPECT_EQ(checkMap(map), "");
}

// As after a period of localisation without success: the odometry drifted, and no keyframe of that way is in the map.
TEST(LoopCloser, AHoleInTheOdometryIsNoStiffEdge) {
  RingWorld world;
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 1.15, 0.32, &truth);
  for (KeyframeId id = 12; id < 88; ++id) map.removeKeyframe(id, ImuNoise(), 30.0);
  EXPECT_EQ(checkMap(map), "");
  ASSERT_EQ(0u, map.keyframe(88).previous);
  LoopCloser closer(LoopOptions(), world.camera());
  EXPECT_FALSE(closeAll(closer, map).empty());
  const SE3 T_first_last = truth.front().inverse() * truth.back();
  const SE3 estimate = map.keyframe(1).state.T_W_I.inverse() * map.keyframe(map.newestKeyframe()).state.T_W_I;
  EXPECT_LT((estimate.t() - T_first_last.t()).norm(), 0.1);
}

TEST(LoopCloser, TwoRunsGiveTheSameBits) {
  const auto run = [] {
    RingWorld world;
    Map map;
    std::vector<SE3> truth;
    world.walk(map, 1.1, 0.3, &truth);
    LoopCloser closer(LoopOptions(), world.camera());
    closeAll(closer, map);
    return map.keyframe(map.newestKeyframe()).state.T_W_I.matrix();
  };
  EXPECT_EQ(run(), run());
}

TEST(Relocaliser, FindsItsPlaceAndRefusesTwoThatLookAlike) {
  for (const int bays : {1, 6}) {
    RingWorld world(bays);
    Map map;
    std::vector<SE3> truth;
    world.walk(map, 0.9, 0.0, &truth);
    LoopCloser places(LoopOptions(), world.camera());
    places.rebuild(map, {});
    Relocaliser relocaliser{RelocalisationOptions()};
    int found = 0;
    for (int k = 0; k < 20; ++k) {
      // Off the path, with another heading and in another odometry frame.
      SE3 T = world.truth(0.3 + 0.22 * k);
      T = T *
          SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(-0.3, 0.2, 0.1));
      const SE3 T_odom_map(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())),
                           Eigen::Vector3d(7, 8, 0));
      const KeyframePtr query = world.see(1000, 900, T, T_odom_map * T, 500000);
      const auto result = relocaliser.relocalise(map, places, query);
      if (!result) continue;
      ++found;
      EXPECT_LT((result->T_W_I.t() - T.t()).norm(), 0.03);
      const SE3 T_map_odom = alignLevelled(result->T_W_I, query->frame.state.T_W_I);
      EXPECT_LT(((T_map_odom * T_odom_map).t()).norm(), 0.06);
    }
    if (bays == 1)
      EXPECT_GE(found, 19);
    else
      EXPECT_EQ(found, 0);
  }
}

}  // namespace
}  // namespace vip_slam
