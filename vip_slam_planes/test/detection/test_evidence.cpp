// SPDX-License-Identifier: BSD-3-Clause
// Planes from several keyframes together.
#include <numeric>

#include <gtest/gtest.h>

#include "vip_slam_planes/detection/plane_evidence.h"
#include "vip_slam_planes/detection/surface_shape.h"

namespace vip_slam {
namespace {

// A meshed rectangle in the plane x = 3 that faces the origin, cells of 10 cm.
std::vector<MapTriangle> board(double y0, double z0, int columns, int rows, double lean = 0) {
  constexpr double kCell = 0.1;
  std::vector<MapTriangle> mesh;
  const Eigen::Vector3d n = Eigen::Vector3d(-1, lean, 0).normalized();
  const auto vertex = [&](int c, int r) {
    return Eigen::Vector3d(3 + lean * c * kCell, y0 + c * kCell, z0 + r * kCell);
  };
  const auto number = [&](int c, int r) { return r * (columns + 1) + c; };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int lower = 2 * (r * columns + c), upper = lower + 1;
      MapTriangle a, b;
      a.corner = {vertex(c, r), vertex(c + 1, r), vertex(c, r + 1)};
      a.vertex = {number(c, r), number(c + 1, r), number(c, r + 1)};
      a.neighbour = {upper, c > 0 ? lower - 1 : -1, r > 0 ? lower - 2 * columns + 1 : -1};
      b.corner = {vertex(c + 1, r + 1), vertex(c, r + 1), vertex(c + 1, r)};
      b.vertex = {number(c + 1, r + 1), number(c, r + 1), number(c + 1, r)};
      b.neighbour = {lower, c + 1 < columns ? upper + 1 : -1, r + 1 < rows ? upper + 2 * columns - 1 : -1};
      for (MapTriangle* t : {&a, &b}) {
        t->n = n;
        t->centre = (t->corner[0] + t->corner[1] + t->corner[2]) / 3;
        t->area = 0.5 * kCell * kCell;
        t->sigma = 0.004;
        t->sigma_angle = 0.05;
        mesh.push_back(*t);
      }
    }
  }
  return mesh;
}

// A meshed rectangle at height z that faces up.
std::vector<MapTriangle> shelf(double x0, double y0, double z, int columns, int rows) {
  // The board turned about the y axis: its x = 3 becomes the height.
  std::vector<MapTriangle> mesh = board(y0, 0, columns, rows);
  for (MapTriangle& t : mesh) {
    for (Eigen::Vector3d* p : {&t.corner[0], &t.corner[1], &t.corner[2], &t.centre}) *p = {x0 + p->z(), p->y(), z};
    t.n = Eigen::Vector3d::UnitZ();
  }
  return mesh;
}

std::vector<MapTriangle> together(std::vector<MapTriangle> a, const std::vector<MapTriangle>& b) {
  const int triangles = static_cast<int>(a.size()), vertices = 1000;  // more than a has
  for (MapTriangle t : b) {
    for (int& g : t.neighbour) g = g < 0 ? -1 : g + triangles;
    for (int& k : t.vertex) k += vertices;
    a.push_back(t);
  }
  return a;
}

class Evidence : public ::testing::Test {
 protected:
  std::vector<JointPlane> add(KeyframeId id, const std::vector<MapTriangle>& mesh) {
    poses[id] = SE3(Eigen::Quaterniond::Identity(), {0, 0.1 * double(id), 1});
    evidence.add(id, poses[id], mesh, std::vector<int>(mesh.size(), -1), std::vector<PlaneId>(mesh.size()));
    return evidence.detect(poses, {});
  }
  CameraPoses poses;
  PlaneEvidence evidence{PlaneDetectionOptions{}, PlaneGrowthOptions{}};
};

TEST(Shape, AFaceOfThreeColumnsIsAStrip) {
  const auto solid = [](int cells) {
    const std::vector<MapTriangle> mesh = board(0, 0, cells, 12);
    std::vector<int> all(mesh.size());
    std::iota(all.begin(), all.end(), 0);
    return isSolid(mesh, all);
  };
  EXPECT_FALSE(solid(1));
  EXPECT_FALSE(solid(2));  // one inner column: the outer two may belong to adjacent surfaces
  EXPECT_TRUE(solid(3));
  EXPECT_TRUE(solid(6));
}

TEST_F(Evidence, PiecesOfOneWallInSeveralKeyframesStartIt) {
  EXPECT_TRUE(add(1, board(0.0, 0.8, 4, 5)).empty());
  EXPECT_TRUE(add(2, board(0.1, 0.8, 4, 5)).empty());  // 0.25 of 0.3 m^2
  const std::vector<JointPlane> found = add(3, board(0.4, 0.8, 5, 5));
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(PlaneKind::kVertical, found[0].kind);
  EXPECT_LT(angleBetween(Plane({-1, 0, 0}, 3), found[0].plane), 1e-6);
  EXPECT_NEAR(3, found[0].plane.d, 1e-6);
  EXPECT_GT(found[0].triangles.size(), 120u);  // of 130: corners may fall out of the patches
  EXPECT_TRUE(add(4, {}).empty());             // its triangles have been consumed
}

TEST_F(Evidence, SeeingASmallThingOftenDoesNotMakeItLarge) {
  for (KeyframeId id = 1; id <= 8; ++id) EXPECT_TRUE(add(id, board(0.0, 0.8, 5, 5)).empty()) << id;
}

TEST_F(Evidence, WhatWasTooSmallIsTestedAgainWhenMoreOfItHasShown) {
  KeyframeId id = 1;
  for (; id <= 6; ++id) EXPECT_TRUE(add(id, board(0.0, 0.8, 5, 5)).empty()) << id;
  std::size_t found = 0;
  for (; id <= 9; ++id) found += add(id, board(0.1 * double(id - 5), 0.8, 5, 5)).size();
  EXPECT_EQ(1u, found);
}

TEST_F(Evidence, WhatFailedIsTestedAgainWhenKeyframesHaveMoved) {
  // Six views of one wall, half of them with poses that are 20 cm off: they do not agree on a large enough area.
  const auto view = [](KeyframeId id) { return board(id % 2 ? 0.0 : 0.3, 0.8, 5, 5); };
  for (KeyframeId id = 1; id <= 6; ++id) {
    poses[id] = SE3(Eigen::Quaterniond::Identity(), {id % 2 ? 0.0 : 0.2, 0.1 * double(id), 1});
    SE3 seen_from = poses[id];
    seen_from.t().x() = 0;
    evidence.add(id, seen_from, view(id), std::vector<int>(view(id).size(), -1), std::vector<PlaneId>(view(id).size()));
    EXPECT_TRUE(evidence.detect(poses, {}).empty()) << id;
  }
  for (auto& [id, pose] : poses) pose.t().x() = 0;
  EXPECT_TRUE(evidence.detect(poses, {}).empty());  // failed before, and the move is not noticed yet
  evidence.forgetTests();
  EXPECT_EQ(1u, evidence.detect(poses, {}).size());
}

TEST_F(Evidence, StripsOneCellWideAreNoWall) {
  for (KeyframeId id = 1; id <= 4; ++id) EXPECT_TRUE(add(id, board(0.1 * double(id), 0.0, 1, 20)).empty()) << id;
}

TEST_F(Evidence, WhatShowsOfAWorktopStartsItBetweenTheTraysOnIt) {
  // A dark worktop gives depth only in a small piece; the trays next to it are larger, but too narrow for a plane.
  const auto view = [](double shift) {
    return together(shelf(1.0 + shift, 0.0, 0.0, 3, 2), shelf(1.0, 0.4, 0.045, 12, 1));
  };
  EXPECT_TRUE(add(1, view(0.0)).empty());
  const std::vector<JointPlane> found = add(2, view(0.05));
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(PlaneKind::kHorizontal, found[0].kind);
  EXPECT_NEAR(0.0, found[0].plane.d, 1e-3);
  EXPECT_EQ(24u, found[0].triangles.size());
}

TEST_F(Evidence, TheWorktopUnderKnownTraysStartsWhenItWasToldFromThem) {
  PlaneTrack trays(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, -0.045), {1, 0.4, 0.045}, 0.1);
  for (const MapTriangle& t : shelf(1.0, 0.4, 0.045, 8, 2)) trays.cover(t, 1, SE3(), nullptr);
  const auto planes = [&](double first_height, PlaneId first_beside, PlaneId beside) {
    evidence.clear();
    std::vector<JointPlane> all;
    for (KeyframeId id = 1; id <= 2; ++id) {
      poses[id] = SE3(Eigen::Quaterniond::Identity(), {0, 0.1 * double(id), 1});
      const std::vector<MapTriangle> mesh = shelf(1.0 + 0.05 * double(id), 0.0, id == 1 ? first_height : 0.0, 3, 2);
      evidence.add(id, poses[id], mesh, std::vector<int>(mesh.size(), -1),
                   std::vector<PlaneId>(mesh.size(), id == 1 ? first_beside : beside));
      for (const JointPlane& plane : evidence.detect(poses, {&trays})) all.push_back(plane);
    }
    return all;
  };
  EXPECT_TRUE(planes(0.0, 0, 0).empty());
  // The trays were not known yet when the first keyframe saw the worktop.
  for (const PlaneId first : {PlaneId(0), trays.id()}) {
    const std::vector<JointPlane> found = planes(0.0, first, trays.id());
    ASSERT_EQ(1u, found.size()) << first;
    EXPECT_NEAR(0.0, found[0].plane.d, 1e-3);
    EXPECT_EQ(24u, found[0].triangles.size());
  }
  // What it left over of the trays themselves is no evidence of the worktop.
  EXPECT_TRUE(planes(0.04, 0, trays.id()).empty());
}

TEST_F(Evidence, WhatLiesOnAFloorStartsNothing) {
  for (const double height : {0.06, 0.14}) {
    evidence.clear();
    PlaneTrack floor(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, 0), {1, 0, 0}, 0.1);
    for (const MapTriangle& t : shelf(0, -1, 0, 20, 20)) floor.cover(t, 1, SE3(), nullptr);
    std::size_t found = 0;
    for (KeyframeId id = 1; id <= 3; ++id) {
      poses[id] = SE3(Eigen::Quaterniond::Identity(), {0, 0.1 * double(id), 1});
      const std::vector<MapTriangle> mesh = shelf(1.0, 0.0, height, 3, 4);
      evidence.add(id, poses[id], mesh, std::vector<int>(mesh.size(), -1), std::vector<PlaneId>(mesh.size()));
      found += evidence.detect(poses, {&floor}).size();
    }
    EXPECT_EQ(height > 0.1 ? 1u : 0u, found) << height;
  }
}

TEST_F(Evidence, WallsThatDisagreeAreNotOne) {
  EXPECT_TRUE(add(1, board(0.0, 0.8, 5, 5, -0.5)).empty());
  EXPECT_TRUE(add(2, board(0.2, 0.8, 5, 5, 0.0)).empty());
  EXPECT_TRUE(add(3, board(0.4, 0.8, 5, 5, 0.5)).empty());
}

TEST_F(Evidence, FollowsTheKeyframesAndForgetsThem) {
  add(1, board(0.0, 0.8, 5, 5));
  add(2, board(0.05, 0.8, 5, 5));
  PlaneTrack track(1, PlaneKind::kVertical, Plane({-1, 0, 0}, 3), {3, 0.2, 1}, 0.1);
  for (const MapTriangle& t : board(0.0, 0.8, 7, 5)) track.cover(t, 1, poses[1], nullptr);
  EXPECT_EQ(2, evidence.seenBy(track, poses, 0.1));
  EXPECT_EQ(0, evidence.seenBy(track, poses, 0.3));
  poses[2].t().x() += 0.3;  // corrected: it saw something else
  EXPECT_EQ(1, evidence.seenBy(track, poses, 0.1));
  evidence.remove(1);
  EXPECT_EQ(0, evidence.seenBy(track, poses, 0.1));
  // With the other one removed as well, a third alone does not suffice.
  poses[2].t().x() -= 0.3;
  evidence.remove(2);
  EXPECT_TRUE(add(3, board(0.4, 0.8, 5, 5)).empty());
}

TEST_F(Evidence, WhatWasLeftOverJoinsThePlaneThatGrowsUpToIt) {
  // Two pieces of a floor, 0.6 m apart; the plane begins with the first.
  PlaneTrack floor(7, PlaneKind::kHorizontal, Plane({0, 0, 1}, 0), {1, 0, 0}, 0.1);
  for (const MapTriangle& t : shelf(1.0, 0.0, 0.0, 3, 3)) floor.cover(t, 1, SE3(), nullptr);
  const auto leaveOver = [&](double height, PlaneId beside) {
    evidence.clear();
    poses[1] = SE3(Eigen::Quaterniond::Identity(), {0, 0, 1});
    const std::vector<MapTriangle> mesh = shelf(1.0, 0.9, height, 3, 3);
    evidence.add(1, poses[1], mesh, std::vector<int>(mesh.size(), -1), std::vector<PlaneId>(mesh.size(), beside));
  };
  leaveOver(0.01, 0);
  EXPECT_TRUE(evidence.takeJoining(poses, {&floor}).empty());
  for (const MapTriangle& t : shelf(1.0, 0.3, 0.0, 5, 3)) floor.cover(t, 2, SE3(), nullptr);
  EXPECT_TRUE(evidence.takeJoining({}, {&floor}).empty());  // nobody knows where it is
  const auto joining = evidence.takeJoining(poses, {&floor});
  ASSERT_EQ(18u, joining.size());
  for (const auto& [plane, e] : joining) {
    EXPECT_EQ(&floor, plane);
    EXPECT_EQ(1u, e.keyframe);
  }
  EXPECT_TRUE(evidence.takeJoining(poses, {&floor}).empty());  // it is kept no longer
  leaveOver(0.04, 0);                                          // near enough to grow, but perhaps a tray
  EXPECT_TRUE(evidence.takeJoining(poses, {&floor}).empty());
  leaveOver(0.01, floor.id());  // told to be another layer
  EXPECT_TRUE(evidence.takeJoining(poses, {&floor}).empty());
}

TEST_F(Evidence, WhatAKnownPlaneExplainsStartsNoOther) {
  PlaneTrack track(1, PlaneKind::kVertical, Plane({-1, 0, 0}, 3), {3, 0.2, 1}, 0.1);
  for (const MapTriangle& t : board(0.0, 0.8, 9, 5)) track.cover(t, 1, SE3(), nullptr);
  for (KeyframeId id = 1; id <= 4; ++id) {
    poses[id] = SE3(Eigen::Quaterniond::Identity(), {0, 0.1 * double(id), 1});
    const std::vector<MapTriangle> mesh = board(0.1 * double(id), 0.8, 5, 5);
    evidence.add(id, poses[id], mesh, std::vector<int>(mesh.size(), -1), std::vector<PlaneId>(mesh.size()));
    EXPECT_TRUE(evidence.detect(poses, {&track}).empty()) << id;
  }
}

}  // namespace
}  // namespace vip_slam
