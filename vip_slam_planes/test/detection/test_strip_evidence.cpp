// SPDX-License-Identifier: BSD-3-Clause
// Narrow faces, whose orientation becomes certain only when they are seen from two sides.
#include <cmath>

#include <gtest/gtest.h>

#include "rig.h"
#include "strip.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/detection/strip_evidence.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Rig;
using testing::Scene;
using testing::strip;

/// What the second keyframe shows: the same strip, a part of it, or a part of it that continues as another face.
enum class Second { kStrip, kLess, kLessOfABody };

/// Result of keyframes that look along the x axis, turned to the side by `turn`, if the strip turns by `share` of it.
std::vector<JointPlane> facesSeenFrom(double turn, double share, double sigma = 0.002, Second second = Second::kStrip) {
  StripEvidence evidence{PlaneDetectionOptions(), PlaneGrowthOptions()};
  CameraPoses poses;
  for (KeyframeId id : {1, 2}) {
    const double sight = 20 * kDegree + (id == 2 ? turn : 0.0);
    poses[id] = lookAt({3.2 - 3 * std::cos(sight), 3 * std::sin(sight), 1.5}, {3.2, 0, 1.5});
    std::vector<MapTriangle> triangles = strip(id == 2 ? -share * turn : 0.0, sigma);
    if (id == 2 && second != Second::kStrip) {
      triangles.resize(6);
      const std::size_t all = second == Second::kLessOfABody ? 12 : 6;
      while (triangles.size() < all) {  // turned by 24 degrees, before the near end
        MapTriangle t = triangles[triangles.size() - 6];
        for (Eigen::Vector3d& p : t.corner) p += Eigen::Vector3d(-0.3, -0.07, 0);
        t.centre += Eigen::Vector3d(-0.3, -0.07, 0);
        t.n = Eigen::AngleAxisd(24 * kDegree, Eigen::Vector3d::UnitZ()) * t.n;
        triangles.push_back(t);
      }
      evidence.add(id, poses[id], triangles, std::vector<int>(triangles.size(), -1), {});
      continue;
    }
    evidence.add(id, poses[id], triangles, std::vector<int>(triangles.size(), -1), {testing::foundStrip(triangles)});
    if (id == 1) EXPECT_TRUE(evidence.detect(poses).empty());
  }
  return evidence.detect(poses);
}

TEST(StripEvidence, AFaceKeepsItsDirection) {
  for (double turn : {4 * kDegree, 10 * kDegree, -10 * kDegree}) {
    const std::vector<JointPlane> found = facesSeenFrom(turn, 0.0);
    ASSERT_EQ(1u, found.size()) << turn;
    EXPECT_EQ(40u, found[0].triangles.size());
    EXPECT_EQ(PlaneKind::kVertical, found[0].kind);
    EXPECT_LT((found[0].plane.n - Eigen::Vector3d::UnitY()).norm(), 1e-6);
    EXPECT_NEAR(found[0].plane.d, 0.0, 1e-6);
  }
}

TEST(StripEvidence, WhatLiesAlongTheLineOfSightIsNone) {
  for (double turn : {4 * kDegree, 10 * kDegree, -10 * kDegree}) EXPECT_TRUE(facesSeenFrom(turn, 1.0).empty()) << turn;
}

TEST(StripEvidence, NothingIsKnownFromOneSideOrUnderNoise) {
  EXPECT_TRUE(facesSeenFrom(1 * kDegree, 0.0).empty());
  EXPECT_TRUE(facesSeenFrom(4 * kDegree, 0.0, 0.01).empty());
}

TEST(StripEvidence, AStripAndAFewTrianglesOfItMakeAFaceButNotOfABody) {
  const std::vector<JointPlane> found = facesSeenFrom(6 * kDegree, 0.0, 0.002, Second::kLess);
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(26u, found[0].triangles.size());
  EXPECT_TRUE(facesSeenFrom(6 * kDegree, 1.0, 0.002, Second::kLess).empty());
  EXPECT_TRUE(facesSeenFrom(1 * kDegree, 0.0, 0.002, Second::kLess).empty());
  EXPECT_TRUE(facesSeenFrom(6 * kDegree, 0.0, 0.002, Second::kLessOfABody).empty());
}

TEST(StripEvidence, TheSideOfAPillarIsFound) {
  Rig rig(0.5);
  Scene scene;
  scene.add({3, -0.225, 0}, {0, 0.45, 0}, {0, 0, 2.6});
  scene.add({3, 0.225, 0}, {0.45, 0, 0}, {0, 0, 2.6});
  scene.add({8, -5, 0}, {0, 10, 0}, {0, 0, 2.6});
  for (int i = 0; i < 6; ++i) rig.look(scene, {-0.4 + 0.16 * i, 1.0 + 0.08 * i, 1.3}, {3.2, 0.3, 1.3});
  ASSERT_EQ(3u, rig.mapper.planes().size());
  const PlaneEstimate& side = rig.mapper.planes().back();
  EXPECT_GT(side.plane.n.y(), std::cos(2 * kDegree));
  EXPECT_LT(std::abs(side.plane.signedDistance({3.2, 0.225, 1.3})), 0.01);
  EXPECT_GT(side.area, 0.4);
}

}  // namespace
}  // namespace vip_slam
