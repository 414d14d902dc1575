// SPDX-License-Identifier: BSD-3-Clause
// Every image's pose follows the final keyframes.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "vip_slam_core/trajectory/anchored_trajectory.h"
#include "vip_slam_core/trajectory/time_passes.h"

namespace vip_slam {
namespace {

SE3 at(double x, double yaw = 0) { return SE3(expQuaternion({0, 0, yaw}), {x, 0, 0}); }

TEST(AnchorTrajectory, FollowsACommonCorrection) {
  const SE3 T_map_odom(expQuaternion({0.1, -0.2, 0.3}), {1, 2, 3});
  std::vector<ChainedPose> chain;
  std::vector<Anchor> anchors;
  for (int i = 0; i <= 20; ++i) {
    const SE3 T = at(0.1 * i, 0.05 * i);
    chain.push_back({double(i), 1, T});
    if (i % 7 == 3) anchors.push_back({double(i), 1, T, T_map_odom * T, {}});
  }
  const Trajectory trajectory = anchorTrajectory(chain, anchors);
  ASSERT_EQ(trajectory.size(), chain.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_LT(trajectory[i].T_W_B.boxminus(T_map_odom * chain[i].T_chain_C).norm(), 1e-12) << i;
  }
}

TEST(AnchorTrajectory, BlendsBetweenKeyframesFarFromTheOrigin) {
  // A yaw correction 100 m from the origin of odom: images between the keyframes must stay between them.
  std::vector<ChainedPose> chain;
  for (int i = 0; i <= 10; ++i) chain.push_back({double(i), 1, at(100 + 0.1 * i)});
  const std::vector<Anchor> anchors = {{0, 1, at(100), at(100), {}}, {10, 1, at(101), at(101, 0.4), {}}};
  const Trajectory trajectory = anchorTrajectory(chain, anchors);
  ASSERT_EQ(trajectory.size(), 11u);
  EXPECT_LT(trajectory.front().T_W_B.boxminus(at(100)).norm(), 1e-12);
  EXPECT_LT(trajectory.back().T_W_B.boxminus(at(101, 0.4)).norm(), 1e-12);
  for (int i = 0; i <= 10; ++i) EXPECT_LT((trajectory[i].T_W_B.t() - chain[i].T_chain_C.t()).norm(), 0.2) << i;
  EXPECT_NEAR(yawOf(trajectory[5].T_W_B.rotation()), 0.2, 1e-9);
}

TEST(AnchorTrajectory, ACorrectionGoesWhereTheChainMayHaveGoneWrong) {
  // Two seconds of tracking, eight without images, in which a wrong acceleration of 0.03 m/s^2 makes an error of its
  // square, two of tracking. The last keyframe knows where it is.
  const auto wrong = [](double t) { return 0.015 * std::pow(std::clamp(t - 2.0, 0.0, 8.0), 2); };
  std::vector<ChainedPose> chain;
  for (int i = 0; i <= 120; ++i) {
    const double t = 0.1 * i;
    const double sigma = t > 2 && t < 10 ? 0.05 * (t - 2) : 0.002;
    chain.push_back({t, 1, at(0.4 * t + wrong(t)), sigma});
  }
  const std::vector<Anchor> anchors = {{0, 1, at(0), at(0), {}}, {12, 1, chain.back().T_chain_C, at(4.8), {}}};
  const Trajectory trajectory = anchorTrajectory(chain, anchors);
  ASSERT_EQ(trajectory.size(), chain.size());
  EXPECT_NEAR(wrong(12), 0.96, 1e-9);
  for (const StampedPose& pose : trajectory) EXPECT_NEAR(pose.T_W_B.t().x(), 0.4 * pose.t, 0.02) << pose.t;
}

TEST(AnchorTrajectory, TheBodyFollowsTheCameraByTheExtrinsicsKnownNow) {
  const SE3 T_I_C(expQuaternion({-1.2, 1.2, -1.2}), {0.05, 0, 0});
  const SE3 T_chain_map(expQuaternion({0.1, 0.2, -0.3}), {1, 0, 2});
  std::vector<SE3> truth;
  std::vector<ChainedPose> chain;
  std::vector<Anchor> anchors;
  for (int i = 0; i <= 10; ++i) {
    truth.push_back(SE3(expQuaternion({0.01 * i, 0.02 * i, 0.3 * i}), {0.2 * i, 0.1 * i, 0}));
    chain.push_back({double(i), 1, T_chain_map * truth.back() * T_I_C});
    if (i == 2 || i == 6) anchors.push_back({double(i), 1, chain.back().T_chain_C, truth.back(), T_I_C});
  }
  const Trajectory trajectory = anchorTrajectory(chain, anchors);
  ASSERT_EQ(trajectory.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT(trajectory[i].T_W_B.boxminus(truth[i]).norm(), 1e-12) << i;
  }
}

TEST(AnchorTrajectory, EpochsDoNotMix) {
  const std::vector<ChainedPose> chain = {{0, 0, at(0)}, {1, 1, at(5)}, {2, 1, at(6)}, {3, 2, at(9)}};
  const std::vector<Anchor> anchors = {{1, 1, at(5), at(50), {}}};
  const Trajectory trajectory = anchorTrajectory(chain, anchors);
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_NEAR(trajectory[0].T_W_B.t().x(), 50, 1e-12);
  EXPECT_NEAR(trajectory[1].T_W_B.t().x(), 51, 1e-12);
}

std::vector<double> taken(const std::vector<double>& stamps) {
  TimePasses passes;
  std::vector<double> result;
  for (const double t : stamps)
    if (passes.take(t)) result.push_back(t);
  return result;
}

TEST(TimePasses, EachTimeCountsOnceThatOfTheFirstPass) {
  using List = std::vector<double>;
  EXPECT_EQ(taken({1, 2, 3}), (List{1, 2, 3}));
  EXPECT_EQ(taken({1, 2, 2, 3}), (List{1, 2, 3}));                             // a repeated stamp
  EXPECT_EQ(taken({11, 12, 13, 1, 2, 3}), (List{11, 12, 13, 1, 2, 3}));        // two recordings, joined
  EXPECT_EQ(taken({1, 2, 3, 1, 2, 3, 4, 1.5, 4.5}), (List{1, 2, 3, 4, 4.5}));  // a bag that loops, each time longer
  EXPECT_EQ(taken({5, 6, 1, 5.5, 7, 6.5}), (List{5, 6, 1, 7}));                // the second pass goes beyond the first
}

}  // namespace
}  // namespace vip_slam
