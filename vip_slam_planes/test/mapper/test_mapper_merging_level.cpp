// SPDX-License-Identifier: BSD-3-Clause
// Which pieces of floors, tables and ceilings the plane module merges into one surface, on exact scenes.
#include <cmath>

#include <gtest/gtest.h>

#include "rig.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Rig;
using testing::Scene;

TEST(Mapper, ASmallPieceOfFloorBelongsToTheFloorBehindABoard) {
  for (const double step : {0.0, 0.05}) {
    Rig rig;
    Scene scene;
    scene.add({0, -3, 0}, {5, 0, 0}, {0, 6, 0});
    scene.add({5.05, -3, 0}, {0, 6, 0}, {0, 0, 1.6});
    scene.add({6.5, -0.7, step}, {1.2, 0, 0}, {0, 1.4, 0});  // 1.5 m further on, 1.7 m^2
    for (double y = -2; y <= 2; y += 0.4) {
      rig.look(scene, {0.5, y, 1.4}, {2.5, y, 0});
      rig.look(scene, {2.5, y, 1.4}, {4.5, y, 0});
    }
    for (int i = 0; i < 4; ++i) rig.look(scene, {6.1, 0.1 * i, 1.4}, {7.1, 0, step});
    EXPECT_EQ(step == 0 ? 1 : 2, rig.count(Plane({0, 0, 1}, 0), 0.1)) << step;
  }
}

TEST(Mapper, ASmallPieceOfCeilingBelongsToTheCeilingBehindABeam) {
  for (const double step : {0.0, 0.04}) {
    Rig rig;
    Scene scene;
    scene.add({0, -1.5, 2.5}, {2, 0, 0}, {0, 3, 0});
    scene.add({2.05, -1.5, 1.4}, {0, 3, 0}, {0, 0, 1.2});
    scene.add({4.5, -0.4, 2.5 - step}, {0.9, 0, 0}, {0, 0.9, 0});  // 2.5 m further on, 0.8 m^2
    for (double y = -1; y <= 1; y += 0.4) rig.look(scene, {-1.0, y, 1.2}, {1.0, y, 2.5});
    for (int i = 0; i < 6; ++i) rig.look(scene, {4.25, 0.1 * i - 0.2, 1.2}, {5.0, 0, 2.5 - step});
    EXPECT_EQ(step == 0 ? 1 : 2, rig.count(Plane({0, 0, -1}, 2.5), 0.1)) << step;
  }
}

// Two keyframes that saw one end of it first are placed slightly too low.
TEST(Mapper, ACeilingWhoseEndsMeetIsOne) {
  for (const double off : {0.025, 0.07}) {
    Rig rig;
    Scene scene;
    scene.add({0, -1.5, 2.5}, {7, 0, 0}, {0, 3, 0});
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d eye(3.6, 0.4 * i - 0.2, 1.2), target(6.2, 0, 2.5);
      const Eigen::Vector3d down(0, 0, off);
      rig.place(rig.camera.keyframe(scene, lookAt(eye, target)), lookAt(eye - down, target - down));
    }
    for (double x = -1; x < 2.9; x += 0.4) rig.look(scene, {x, 0, 1.2}, {x + 0.8, 0, 2.5});
    EXPECT_EQ(off < 0.05 ? 1u : 2u, rig.mapper.planes().size()) << off;
  }
}

TEST(Mapper, TablesOfOneHeightStayTwo) {
  Rig rig;
  Scene scene;
  scene.add({1.0, -1.8, 0.75}, {1.0, 0, 0}, {0, 1.4, 0});
  scene.add({1.0, 0.4, 0.75}, {1.0, 0, 0}, {0, 1.4, 0});
  for (int i = 0; i < 4; ++i) rig.look(scene, {-0.3, -1.1 + 0.1 * i, 1.5}, {1.5, -1.1, 0.75});
  for (int i = 0; i < 4; ++i) rig.look(scene, {-0.3, 1.1 + 0.1 * i, 1.5}, {1.5, 1.1, 0.75});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  for (const PlaneEstimate& table : rig.mapper.planes()) EXPECT_NEAR(-0.75, table.plane.d, 0.004);
}

// A counter whose middle is hidden by a cupboard, the same with a step behind it, and two counters with an aisle.
TEST(Mapper, ACounterGoesOnBehindACupboardButNotAcrossAnAisle) {
  struct Case {
    bool cupboard, floor;
    double step;
    int counters;
  };
  for (const Case& c :
       {Case{true, true, 0, 1}, Case{true, true, 0.03, 2}, Case{false, true, 0, 2}, Case{false, false, 0, 2}}) {
    Rig rig(0.3);
    Scene scene;
    const double length = c.cupboard ? 2.0 : 1.4;
    scene.add({1, -2, 0.9}, {0.6, 0, 0}, {0, length, 0});
    scene.add({1, 2 - length, 0.9 + c.step}, {0.6, 0, 0}, {0, length, 0});
    if (c.cupboard) scene.add({0.8, -0.7, 0}, {0, 1.4, 0}, {0, 0, 2.2});
    if (c.floor) scene.add({-3, -4, 0}, {6, 0, 0}, {0, 8, 0});
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i < 4; ++i) rig.look(scene, {-0.6, side * (1.2 + 0.1 * i), 1.6}, {1.3, side * 1.3, 0.9});
    }
    int counters = 0;
    for (const PlaneEstimate& p : rig.mapper.planes()) counters += p.plane.n.z() > 0.9 && p.plane.d < -0.5;
    EXPECT_EQ(c.counters, counters) << (c.cupboard ? "cupboard" : "aisle") << ", step " << c.step;
  }
}

// Two desks of equal height, seen at such a flat angle that the gap hardly shows; then from above, where it shows.
TEST(Mapper, DesksSeenFromAfarStayTwo) {
  for (const double x : {0.0, -1.5}) {  // at 82 and 85 degrees from upright
    Rig rig(0.3);
    Scene scene;
    scene.add({3, -1.8, 0.75}, {0.8, 0, 0}, {0, 1.4, 0});
    scene.add({3, 0.4, 0.75}, {0.8, 0, 0}, {0, 1.4, 0});
    scene.add({-3, -4, 0}, {9, 0, 0}, {0, 8, 0});
    scene.add({6, -4, 0}, {0, 8, 0}, {0, 0, 2.6});
    for (int i = 0; i < 6; ++i) rig.look(scene, {x + 0.1 * i, 0.05 * i, 1.2}, {3.4, 0, 0.75});
    for (int i = 0; i < 3; ++i) rig.look(scene, {2.2, 0.1 * i - 0.1, 1.7}, {3.4, 0, 0.75});
    int desks = 0;
    for (const PlaneEstimate& p : rig.mapper.planes()) desks += p.plane.n.z() > 0.9 && p.plane.d < -0.5;
    EXPECT_EQ(2, desks) << x;
  }
}

// A threshold or the floor of a wet room: one keyframe shows both levels, so that the step is no drift.
TEST(Mapper, AStepOfThreeCentimetresInAFloorStays) {
  Scene scene;
  scene.add({-6, -2, 0}, {6, 0, 0}, {0, 4, 0});
  scene.add({0, -2, -0.03}, {6, 0, 0}, {0, 4, 0});
  scene.add({-6, -2, -0.03}, {12, 0, 0}, {0, 0, 2.6});
  scene.add({-6, 2, -0.03}, {12, 0, 0}, {0, 0, 2.6});
  Rig rig;
  for (int i = 0; i < 16; ++i) rig.look(scene, {-5 + 0.5 * i, 0, 1.4}, {-2.5 + 0.5 * i, 0.2, 0});
  EXPECT_TRUE(rig.find(Plane({0, 0, 1}, 0), 0.003));
  EXPECT_TRUE(rig.find(Plane({0, 0, 1}, 0.03), 0.003));
  EXPECT_FALSE(rig.find(Plane({0, 0, 1}, 0.015), 0.008));
}

}  // namespace
}  // namespace vip_slam
