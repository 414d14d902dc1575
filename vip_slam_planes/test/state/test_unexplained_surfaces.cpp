// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <gtest/gtest.h>

#include "../../src/state/unexplained_surfaces.h"
#include "scene.h"
#include "strip.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam::planes {
namespace {

/// Two keyframes that look at one strip from sides 10 degrees apart.
class Unexplained : public ::testing::Test {
 protected:
  std::vector<JointPlane> look(KeyframeId id, int label) {
    const double sight = (id == 1 ? 20 : 30) * kDegree;
    poses[id] = testing::lookAt({3.2 - 3 * std::cos(sight), 3 * std::sin(sight), 1.5}, {3.2, 0, 1.5});
    const std::vector<MapTriangle> triangles = testing::strip(0.0, 0.002);
    const std::vector<int> labels(triangles.size(), label);
    const std::vector<PlaneId> beside(triangles.size());
    EXPECT_TRUE(surfaces.addTriangles(id, triangles, labels, beside, poses, {}).empty());
    return surfaces.addStrips(id, triangles, labels, {testing::foundStrip(triangles)}, poses);
  }

  UnexplainedSurfaces surfaces{PlaneMapperOptions()};
  CameraPoses poses;
};

TEST_F(Unexplained, AStripOfTwoKeyframesIsAFace) {
  EXPECT_TRUE(look(1, -1).empty());
  EXPECT_EQ(look(2, -1).size(), 1u);
}

TEST_F(Unexplained, AStripThatAPlaneExplainsByNowIsNotKept) {
  EXPECT_TRUE(look(1, 0).empty());
  EXPECT_TRUE(look(2, -1).empty());
}

TEST_F(Unexplained, NothingIsLeftOfARemovedKeyframe) {
  EXPECT_TRUE(look(1, -1).empty());
  surfaces.remove(1);
  EXPECT_TRUE(look(2, -1).empty());

  std::vector<MapTriangle> mesh = testing::strip(0.0, 0.002);
  const int count = static_cast<int>(mesh.size());
  for (int i = 0; i < count; ++i) mesh[i].neighbour = {i - 1, i + 1 < count ? i + 1 : -1, -1};
  PlaneTrack face(1, PlaneKind::kVertical, Plane({0, 1, 0}, 0), {3, 0, 1}, PlaneGrowthOptions().cell);
  for (const MapTriangle& t : mesh) face.cover(t, 2, poses.at(2), nullptr);
  poses[3] = poses.at(2);
  surfaces.addTriangles(3, mesh, std::vector<int>(count, -1), std::vector<PlaneId>(count), poses, {});
  EXPECT_EQ(surfaces.seenBy(face, poses, 0.1), 1);
  surfaces.remove(3);
  EXPECT_EQ(surfaces.seenBy(face, poses, 0.1), 0);
}

TEST_F(Unexplained, NothingIsLeftAfterClear) {
  EXPECT_TRUE(look(1, -1).empty());
  surfaces.clear();
  EXPECT_TRUE(look(2, -1).empty());
}

}  // namespace
}  // namespace vip_slam::planes
