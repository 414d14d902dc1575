// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_backend/loop/graph_builder.h"
#include "vip_slam_backend/loop/pose_plane_graph.h"

namespace vip_slam {
namespace {

// A square walk of 40 m that ends where it began. The estimate drifts in yaw and position; tilt is right.
class GraphTest : public ::testing::Test {
 protected:
  static constexpr int kPoses = 80;
  void SetUp() override {
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0, 1);
    const auto tilt = Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
    for (int k = 0; k < kPoses; ++k) {
      const double s = 2 * M_PI * k / kPoses;
      truth_.push_back(SE3(Eigen::Quaterniond(Eigen::AngleAxisd(s, Eigen::Vector3d::UnitZ())) * tilt,
                           Eigen::Vector3d(6 * std::cos(s), 6 * std::sin(s), 1.2)));
    }
    estimate_.push_back(truth_[0]);
    for (int k = 1; k < kPoses; ++k) {
      SE3 step = truth_[k - 1].inverse() * truth_[k];
      SE3 next = estimate_.back() * step;
      const Eigen::Quaterniond yaw(Eigen::AngleAxisd(0.002 + 0.001 * noise(random), Eigen::Vector3d::UnitZ()));
      estimate_.push_back(
          SE3(yaw * next.rotation(), next.t() + 0.005 * Eigen::Vector3d(noise(random), noise(random), 0.3)));
    }
  }
  PosePlaneGraph chain() const {
    PosePlaneGraph graph;
    for (int k = 0; k < kPoses; ++k) graph.addPose(k + 1, estimate_[k]);
    for (int k = 1; k < kPoses; ++k)
      graph.addEdge(RelativePoseEdge{KeyframeId(k), KeyframeId(k + 1), estimate_[k - 1].inverse() * estimate_[k],
                                     diagonalSqrtInformation(0.002, 0.01)});
    return graph;
  }
  double rmse(const PosePlaneSolution& s) const {
    double sum = 0;
    for (int k = 0; k < kPoses; ++k) sum += (s.T_W_I.at(k + 1).t() - truth_[k].t()).squaredNorm();
    return std::sqrt(sum / kPoses);
  }
  std::vector<SE3> truth_, estimate_;
};

TEST_F(GraphTest, WithoutALoopNothingMoves) {
  const PosePlaneSolution s = chain().solve(50);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(s.chi2, 1e-12);
  for (int k = 0; k < kPoses; ++k) EXPECT_LT((s.T_W_I.at(k + 1).t() - estimate_[k].t()).norm(), 1e-9);
}

TEST_F(GraphTest, LoopEdgeRemovesTheDriftAndHoldsTilt) {
  PosePlaneGraph graph = chain();
  const double before = rmse(graph.solve(1));
  graph.addEdge(RelativePoseEdge{1, KeyframeId(kPoses), truth_.front().inverse() * truth_.back(),
                                 diagonalSqrtInformation(0.003, 0.01)});
  const PosePlaneSolution s = graph.solve(50);
  ASSERT_TRUE(s.usable);
  EXPECT_GT(before, 0.2);
  EXPECT_LT(rmse(s), 0.35 * before);
  EXPECT_LT((s.T_W_I.at(kPoses).t() - truth_.back().t()).norm(), 0.05);
  EXPECT_LT(s.T_W_I.at(1).boxminus(estimate_[0]).norm(), 1e-12);  // gauge
  for (int k = 0; k < kPoses; ++k) {
    const Eigen::Vector3d up = s.T_W_I.at(k + 1).rotation().conjugate() * Eigen::Vector3d::UnitZ();
    EXPECT_LT((up - estimate_[k].rotation().conjugate() * Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  }
}

TEST_F(GraphTest, AWallSeenOnTheWayStraightensIt) {
  PosePlaneGraph graph = chain();
  const double before = rmse(graph.solve(1));
  const Plane wall(Eigen::Vector3d(1, 0, 0), 9.0), wall_2(Eigen::Vector3d(0, 1, 0), 9.0);
  graph.addPlane(1, wall);
  graph.addPlane(2, wall_2);
  for (int k = 0; k < kPoses; k += 2)
    for (const auto& w : {std::make_pair(PlaneId(1), wall), std::make_pair(PlaneId(2), wall_2)})
      graph.addEdge(PosePlaneEdge{KeyframeId(k + 1), w.first, transformPlane(truth_[k].inverse(), w.second),
                                  Eigen::Vector3d(200, 200, 100).asDiagonal()});
  const PosePlaneSolution s = graph.solve(50);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(rmse(s), 0.25 * before);
  EXPECT_LT(angleBetween(s.planes.at(1), wall), 0.01);
}

TEST_F(GraphTest, AWrongLoopCostsFarMoreThanATrueOne) {
  const auto cost = [this](const SE3& T_1_n) {
    PosePlaneGraph graph = chain();
    graph.addEdge(RelativePoseEdge{1, KeyframeId(kPoses), T_1_n, diagonalSqrtInformation(0.003, 0.01)});
    return graph.solve(50).chi2;
  };
  SE3 wrong = truth_.front().inverse() * truth_.back();
  const double right_cost = cost(wrong);
  wrong.t() += Eigen::Vector3d(3, 0, 0);
  EXPECT_GT(cost(wrong), 8 * right_cost);
  EXPECT_GT(cost(wrong), 300);
}

TEST_F(GraphTest, SeparatePartsAreHeldSeparately) {
  PosePlaneGraph graph = chain();
  graph.addPose(1000, SE3());
  graph.addPose(1001, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0)));
  graph.addEdge(RelativePoseEdge{1000, 1001, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(2, 0, 0)),
                                 diagonalSqrtInformation(0.01, 0.01)});
  const PosePlaneSolution s = graph.solve(50);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(s.T_W_I.at(1000).t().norm(), 1e-12);
  EXPECT_NEAR(s.T_W_I.at(1001).t().x(), 2.0, 1e-6);
  EXPECT_LT(s.chi2, 1e-9);
}

// The uncertainty of the camera's pose adds to that of the residual, which is in the axes of the match.
TEST(Graph, ALoopIsAsSureAsItsCamera) {
  const SE3 T_W_match(expQuaternion({0.3, -0.2, 1.5}), {1, 2, 3}),
      T_W_query(expQuaternion({-0.1, 0.4, -0.9}), {2, 0, 1});
  const SE3 T_I_C(expQuaternion({0.5, 1.2, -0.4}), {0.3, -0.2, 0.1});
  Vector6d sigma;
  sigma << 0.01, 0.02, 0.03, 0.002, 0.05, 0.2;
  const Matrix6d camera = sigma.cwiseAbs2().asDiagonal();
  PoseGraphOptions options;
  options.loop_sigma_angle_deg = options.loop_sigma_position = 1e-6;
  const Matrix6d L = loopSqrtInformation(camera.inverse(), T_W_match, T_W_query, T_I_C, options);

  const SE3 T_W_C = T_W_query * T_I_C, T_match_query = T_W_match.inverse() * T_W_query;
  Matrix6d J;
  for (int k = 0; k < 6; ++k) {
    constexpr double kStep = 1e-6;
    const SE3 moved = T_W_C.boxplus(kStep * Vector6d::Unit(k)) * T_I_C.inverse();
    J.col(k) = relativePoseResidual(T_W_match, moved, T_match_query) / kStep;
  }
  const Matrix6d expected = J * camera * J.transpose();
  EXPECT_LT(((L.transpose() * L).inverse() - expected).norm(), 1e-4 * expected.norm());
}

TEST(Graph, RefusesUnknownNodes) {
  PosePlaneGraph graph;
  graph.addPose(1, SE3());
  EXPECT_THROW(graph.addEdge(RelativePoseEdge{1, 2, SE3(), Matrix6d::Identity()}), std::invalid_argument);
  EXPECT_THROW(graph.addEdge(RelativePoseEdge{1, 1, SE3(), Matrix6d::Identity()}), std::invalid_argument);
  EXPECT_THROW(graph.addEdge(PosePlaneEdge{1, 7, Plane(), Eigen::Matrix3d::Identity()}), std::invalid_argument);
  EXPECT_FALSE(PosePlaneGraph().solve(10).usable);
}

}  // namespace
}  // namespace vip_slam
