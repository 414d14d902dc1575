// SPDX-License-Identifier: BSD-3-Clause
// How stiff the pose-plane graph takes the odometry between the ends of a loop.
#include <gtest/gtest.h>

#include <memory>

#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/loop/loop_evidence.h"

namespace vip_slam {
namespace {

/// Keyframes a metre apart on a line. Over the step to keyframe `gap` the odometry says it is 0.9 m uncertain.
Map walk(int keyframes, KeyframeId gap = 0) {
  Map map;
  for (int k = 0; k < keyframes; ++k) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = k + 1;
    keyframe->previous = k;
    keyframe->frame.t = 0.5 * k;
    keyframe->frame.status.state = TrackingState::kTracking;
    if (k > 0) {
      const double sigma = keyframe->id == gap ? 0.9 : 0.001;
      keyframe->motion.T_a_b = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
      keyframe->motion.covariance.diagonal() << Eigen::Vector3d::Constant(1e-8),
          Eigen::Vector3d::Constant(sigma * sigma);
    }
    NavState state;
    state.t = keyframe->frame.t;
    state.T_W_I = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(k, 0, 0));
    keyframe->frame.state = state;
    map.addKeyframe(keyframe, state, ImuNoise());
  }
  return map;
}

/// What speaks for a loop between the ends of the walk that is off by so much along the way.
double evidence(const Map& map, double off) {
  const PoseGraphOptions options;
  const auto last = static_cast<KeyframeId>(map.keyframes().size());
  PosePlaneGraph graph = buildPosePlaneGraph(map, {}, {}, {last, 1}, 10, options);
  const double length = map.keyframe(last).state.T_W_I.t().x();
  const auto known = graph.positionCovariance(1, last);
  graph.addEdge(RelativePoseEdge{1, last, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(length + off, 0, 0)),
                                 diagonalSqrtInformation(0.005, 0.02)});
  return poseEvidence(graph.solve(options.max_iterations).chi2, *known + 0.0004 * Eigen::Matrix3d::Identity(), length);
}

// A place that explains three quarters of the image has 2 and more to add, the best 4.
const double kPasses = PoseGraphOptions().min_log_odds - 2, kNever = PoseGraphOptions().min_log_odds - 4;

TEST(GraphBuilder, AGapIsAsLooseAsTheOdometrySays) {
  EXPECT_LT(evidence(walk(12), 1.0), kNever);
  EXPECT_GT(evidence(walk(12, 6), 1.0), kPasses);
  EXPECT_LT(evidence(walk(12, 6), 20), kNever);
  // The step over the gap takes up what the loop says.
  const Map map = walk(12, 6);
  PosePlaneGraph graph = buildPosePlaneGraph(map, {}, {}, {12, 1}, 10, PoseGraphOptions());
  graph.addEdge(RelativePoseEdge{1, 12, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(11.4, 0, 0)),
                                 diagonalSqrtInformation(0.005, 0.02)});
  const PosePlaneSolution solution = graph.solve(50);
  EXPECT_NEAR(solution.T_W_I.at(5).t().x(), 4.0, 0.01);
  EXPECT_NEAR(solution.T_W_I.at(6).t().x(), 5.4, 0.01);
}

// An odometry that is off by the same share everywhere: two per cent of the way, but not ten.
TEST(GraphBuilder, ADriftAddsUpOverTheWay) {
  for (const int way : {20, 50, 100}) {
    const Map map = walk(way + 1);
    EXPECT_GT(evidence(map, 0.005 * way), kPasses) << way;
    EXPECT_GT(evidence(map, 0.02 * way), kPasses) << way;
    EXPECT_LT(evidence(map, 0.1 * way), kNever) << way;
  }
}

}  // namespace
}  // namespace vip_slam
