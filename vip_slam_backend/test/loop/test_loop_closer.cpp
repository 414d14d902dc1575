#include <gtest/gtest.h>

#include "loop/ring_world.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/relocalisation/relocaliser.h"

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
      if (event.accepted) accepted.push_back(event);
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
  EXPECT_LT(map.landmarks().size(), landmarks - 100);  // the second round's points were the first's
  for (const LoopEvent& loop : loops) {
    const SE3 found = loop.T_match_query, right = truth[loop.match - 1].inverse() * truth[loop.query - 1];
    EXPECT_LT((found.t() - right.t()).norm(), 0.03) << loop.query << " -> " << loop.match;
  }
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
  // Six bays that look exactly alike, five metres apart: only odometry tells them apart.
  RingWorld world(6);
  Map map;
  std::vector<SE3> truth;
  world.walk(map, 0.9, 0.1, &truth);
  LoopCloser closer(LoopOptions(), world.camera());
  const auto loops = closeAll(closer, map);
  EXPECT_TRUE(loops.empty()) << loops.size() << " wrong loops, first " << loops.front().query << " -> "
                             << loops.front().match << ": " << loops.front().reason;
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
    const Relocaliser relocaliser{RelocalisationOptions()};
    int found = 0;
    for (int k = 0; k < 20; ++k) {
      // Off the path, another heading, and an odometry frame of its own.
      SE3 T = world.truth(0.3 + 0.22 * k);
      T = T * SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(-0.3, 0.2, 0.1));
      const SE3 T_odom_map(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(7, 8, 0));
      const KeyframePtr query = world.see(1000, 900, T, T_odom_map * T, 500000);
      const auto result = relocaliser.relocalise(map, places, *query);
      if (!result) continue;
      ++found;
      EXPECT_LT((result->T_W_I.t() - T.t()).norm(), 0.03);
      const SE3 T_map_odom = alignOdometry(result->T_W_I, query->frame.state.T_W_I);
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
