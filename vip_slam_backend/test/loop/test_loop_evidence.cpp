// SPDX-License-Identifier: BSD-3-Clause
// What speaks for a loop: how much of the image it explains, and where the map expected it.
#include <cmath>

#include <gtest/gtest.h>

#include "vip_slam_backend/loop/loop_evidence.h"
#include "vip_slam_backend/loop/pose_plane_graph.h"

namespace vip_slam {
namespace {

PlaceCoverage share(int explained, int cells) {
  PlaceCoverage coverage;
  coverage.explained_cells = explained;
  coverage.cells = cells;
  return coverage;
}

Eigen::Matrix3d sigma(double metres) { return metres * metres * Eigen::Matrix3d::Identity(); }

TEST(LoopEvidence, APlaceExplainsMostOfTheImageAndAResemblanceACorner) {
  EXPECT_GT(matchEvidence(share(24, 32)), 2);
  EXPECT_LT(matchEvidence(share(6, 30)), -1.5);
  EXPECT_EQ(matchEvidence(share(0, 0)), 0);
  // The same share of fewer cells says less; a twin explains all of them.
  EXPECT_GT(matchEvidence(share(20, 30)), matchEvidence(share(4, 6)));
  EXPECT_GT(matchEvidence(share(4, 6)), matchEvidence(share(2, 3)));
  EXPECT_LT(matchEvidence(share(48, 48)), 4);
  for (int k = 1; k <= 40; ++k) EXPECT_GT(matchEvidence(share(k, 40)), matchEvidence(share(k - 1, 40))) << k;
}

TEST(LoopEvidence, APlaceWhereTheMapExpectsItNeedsLittleElse) {
  EXPECT_GT(poseEvidence(2, sigma(0.01), 20), 6);
  EXPECT_LT(poseEvidence(20000, sigma(0.01), 20), -20);
  // Where nothing is known of the place, nothing follows from it.
  EXPECT_NEAR(poseEvidence(0, sigma(50), 20), std::log(4), 1e-12);  // but that it faces that way, one of four
  EXPECT_LT(poseEvidence(2, sigma(1.0), 20), poseEvidence(2, sigma(0.1), 20));
  EXPECT_LT(poseEvidence(2, sigma(0.1), 20), poseEvidence(2, sigma(0.1), 200));
}

/// Keyframes a metre apart on a line, all edges with the same sigma of position and of all angles.
PosePlaneGraph line(int poses, double sigma_position, double sigma_angle) {
  PosePlaneGraph graph;
  Matrix6d information = Matrix6d::Identity() / sigma_position;
  information.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() / sigma_angle;
  for (int k = 1; k <= poses; ++k) {
    graph.addPose(k, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(k, 0, 0)));
    if (k > 1)
      graph.addEdge(RelativePoseEdge{KeyframeId(k - 1), KeyframeId(k),
                                     SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0)), information});
  }
  return graph;
}

TEST(LoopEvidence, TheGraphKnowsAPlaceAsWellAsItsBestWay) {
  PosePlaneGraph graph = line(11, 0.1, 0.02);
  const auto along = graph.positionCovariance(1, 11);
  ASSERT_TRUE(along);
  // Ten steps of 0.1 m; sideways the yaw of step k acts over the 10 - k metres left; roll and pitch do not act.
  double lever = 0;
  for (int k = 1; k <= 10; ++k) lever += (10 - k) * (10 - k);
  EXPECT_NEAR((*along)(0, 0), 10 * 0.01, 1e-6);
  EXPECT_NEAR((*along)(1, 1), 10 * 0.01 + 0.0004 * lever, 1e-6);
  EXPECT_NEAR((*along)(2, 2), 10 * 0.01, 1e-6);
  // Seen from the other end the lever arms are those to the first pose: one longer each.
  const auto back = graph.positionCovariance(11, 1);
  ASSERT_TRUE(back);
  EXPECT_NEAR((*back)(0, 0), 10 * 0.01, 1e-6);
  EXPECT_NEAR((*back)(1, 1), 10 * 0.01 + 0.0004 * (lever + 100), 1e-6);
  // A loop between the ends is a better way.
  graph.addEdge(RelativePoseEdge{11, 1, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-10, 0, 0)),
                                 Matrix6d::Identity() / 0.001});
  EXPECT_LT((*graph.positionCovariance(1, 11)).trace(), 0.001);
  graph.addPose(20, SE3());
  EXPECT_FALSE(graph.positionCovariance(1, 20));
}

}  // namespace
}  // namespace vip_slam
