// SPDX-License-Identifier: BSD-3-Clause
// Which triangles join a plane: the gates of 10 degrees and 5 cm, the side, and the reach of the covered area.
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/growth/outline.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

class Growth : public ::testing::Test {
 protected:
  // A wall at x = 3 that faces the origin, 2 x 2 m of it covered around y = z = 0.
  static PlaneTrack wall(double x, PlaneId id = 1) {
    PlaneTrack track(id, PlaneKind::kVertical, Plane({-1, 0, 0}, x), {x, 0, 0}, 0.1);
    for (int b = -10; b < 10; ++b)
      for (int a = -10; a < 10; ++a) track.coverCell({a, b}, 1, 1, SE3());
    return track;
  }
  // A small triangle about `centre`, turned by `angle` about the vertical from the wall's normal.
  static MapTriangle triangle(const Eigen::Vector3d& centre, double angle, double sigma = 0) {
    MapTriangle t;
    t.n = Eigen::Vector3d(-std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d across = 0.05 * Eigen::Vector3d::UnitZ().cross(t.n), up(0, 0, 0.05);
    t.corner = {centre - across - up, centre + across - up, centre + 2 * up};
    t.vertex = {0, 1, 2};
    t.neighbour = {-1, -1, -1};
    t.centre = centre;
    t.area = 0.0075;
    t.sigma = sigma;
    t.sigma_angle = sigma / 0.1;
    return t;
  }
  static int label(const MapTriangle& t, const std::vector<const PlaneTrack*>& tracks) {
    return associateTriangles({t}, tracks, PlaneGrowthOptions()).front();
  }
  const PlaneTrack at_three = wall(3.0);
};

TEST_F(Growth, FiveCentimetresAndTenDegrees) {
  EXPECT_EQ(0, label(triangle({3.049, 0, 0}, 0), {&at_three}));
  EXPECT_EQ(0, label(triangle({2.951, 0, 0}, 0), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3.051, 0, 0}, 0), {&at_three}));
  EXPECT_EQ(-1, label(triangle({2.949, 0, 0}, 0), {&at_three}));
  EXPECT_EQ(0, label(triangle({3, 0, 0}, 9.9 * kDegree), {&at_three}));
  EXPECT_EQ(0, label(triangle({3, 0, 0}, -9.9 * kDegree), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3, 0, 0}, 10.1 * kDegree), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3, 0, 0}, -10.1 * kDegree), {&at_three}));
}

TEST_F(Growth, NoiseWidensTheGatesWithinLimits) {
  EXPECT_EQ(0, label(triangle({3.08, 0, 0}, 20 * kDegree, 0.03), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3.11, 0, 0}, 0, 1.0), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3, 0, 0}, 26 * kDegree, 1.0), {&at_three}));
}

TEST_F(Growth, TheOtherFaceOfAWallDoesNotJoin) { EXPECT_EQ(-1, label(triangle({3, 0, 0}, M_PI), {&at_three})); }

TEST_F(Growth, OfTwoPlanesTheNearerOneTakesIt) {
  const PlaneTrack door = wall(2.92, 2);
  EXPECT_EQ(0, label(triangle({2.97, 0, 0}, 0), {&at_three, &door}));
  EXPECT_EQ(1, label(triangle({2.95, 0, 0}, 0), {&at_three, &door}));
}

// A strip of wall 8 cm behind another plane. Noise moves its triangles in front of the wall, a third of them nearer to
// the other plane.
TEST_F(Growth, ThePatchTellsWhatItsTrianglesDoNot) {
  const PlaneTrack door = wall(2.92, 2);
  const double off[3] = {-0.055, -0.015, -0.01};
  std::vector<MapTriangle> strip;
  for (int i = 0; i < 12; ++i) {
    strip.push_back(triangle({3.0 + off[i % 3], 0.1 * i - 0.6, 0}, 0, 0.04));
    strip.back().neighbour = {i - 1, i + 1 < 12 ? i + 1 : -1, -1};
  }
  EXPECT_EQ(1, label(strip[0], {&at_three, &door})) << "by itself";
  for (int l : associateTriangles(strip, {&at_three, &door}, PlaneGrowthOptions())) EXPECT_EQ(0, l);
  for (int l : associateTriangles(strip, {&door, &at_three}, PlaneGrowthOptions())) EXPECT_EQ(1, l);
  for (MapTriangle& t : strip) t.sigma = 0.01;  // not noise: a step that the mesh bridges
  EXPECT_EQ(1, associateTriangles(strip, {&at_three, &door}, PlaneGrowthOptions())[0]);
  EXPECT_EQ(0, associateTriangles(strip, {&at_three, &door}, PlaneGrowthOptions())[1]);
}

TEST_F(Growth, ASurfaceReachesNoFurtherThanItsGap) {
  EXPECT_EQ(0, label(triangle({3, 1.25, 0}, 0), {&at_three}));
  EXPECT_EQ(-1, label(triangle({3, 1.45, 0}, 0), {&at_three}));
  std::vector<MapTriangle> patch{triangle({3, 1.25, 0}, 0), triangle({3, 1.45, 0}, 0)};
  patch[0].neighbour[0] = 1;
  patch[1].neighbour[0] = 0;
  EXPECT_EQ((std::vector<int>{0, 0}), associateTriangles(patch, {&at_three}, PlaneGrowthOptions()))
      << "a connected patch joins as a whole";
}

TEST_F(Growth, WhenTheNearerPlaneIsOutOfReachTheNextOneIsAsked) {
  PlaneTrack far(2, PlaneKind::kVertical, Plane({-1, 0, 0}, 3.01), {3.01, 8, 0}, 0.1);
  far.coverCell({0, 0}, 1, 1, SE3());
  EXPECT_EQ(1, label(triangle({3.01, 0.3, 0}, 0), {&far, &at_three})) << "also when nothing else joined it yet";
  EXPECT_EQ((std::vector<int>{1, 1}), associateTriangles({triangle({3, 0, 0}, 0), triangle({3.01, 0.3, 0}, 0)},
                                                         {&far, &at_three}, PlaneGrowthOptions()));
}

// At the limit of what noise allows, cells are alternately cleared and covered by successive keyframes.
TEST(PlaneTrack, ACellThatComesAndGoesCountsOnceInAMerge) {
  const auto level = [](PlaneId id) {
    return PlaneTrack(id, PlaneKind::kHorizontal, Plane({0, 0, 1}, 0), Eigen::Vector3d::Zero(), 0.1);
  };
  PlaneTrack flickers = level(2), other = level(1);
  for (KeyframeId host = 1; host < 10; ++host) {
    flickers.coverCell({3, 4}, 1, host, SE3());
    if (host < 9) flickers.miss({3, 4});
  }
  other.absorb(flickers, {});
  EXPECT_EQ(other.cells().at({3, 4}), 1);
}

TEST(PlaneTrack, AStoredPolygonCoversTheCellsWhoseCentresLieInItAndInNoHole) {
  PlaneTrack track(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, 0), Eigen::Vector3d::Zero(), 0.1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> radius(2.0, 6.0);
  Ring2d outer, hole;
  for (int i = 0; i < 40; ++i) {  // a star
    const Eigen::Vector2d out(std::cos(0.05 * M_PI * i), std::sin(0.05 * M_PI * i));
    outer.push_back(radius(random) * out);
    if (i % 4 == 0) hole.push_back(0.25 * radius(random) * out);
  }
  track.coverPolygon(outer, {hole}, 3);
  int covered = 0;
  for (int y = -70; y < 70; ++y) {
    for (int x = -70; x < 70; ++x) {
      const Eigen::Vector2d q((x + 0.5) * 0.1, (y + 0.5) * 0.1);
      const bool inside = ringContains(outer, q) && !ringContains(hole, q);
      EXPECT_EQ(track.cells().at({x, y}), inside ? 3 : 0) << x << ' ' << y;
      covered += inside;
    }
  }
  EXPECT_GT(covered, 1000);
}

// The gap is between the fronts of two cupboards; the other host of the area moves by less than a cell.
TEST(PlaneTrack, AGapOfOneCellStaysOpenWhenTheMapMoves) {
  PlaneTrack track(1, PlaneKind::kVertical, Plane({-1, 0, 0}, 3), {3, 0, 0}, 0.1);
  CameraPoses poses = {{1, SE3()}, {2, SE3()}};
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 9; ++x) track.coverCell({x, y}, 2, 1, SE3());
    for (int x = 10; x < 15; ++x) track.coverCell({x, y}, 2, 2, SE3());
  }
  poses[1] = SE3(Eigen::Quaterniond::Identity(), {0, 0, 0.11});
  poses[2] = SE3(Eigen::Quaterniond::Identity(), {0, 0.02, 0.17});
  track.followKeyframes(poses);
  for (int y = 2; y < 10; ++y) EXPECT_EQ(track.cells().at({9, y}), 0) << y;
  EXPECT_GT(track.cells().count(1), 150);
}

}  // namespace
}  // namespace vip_slam
