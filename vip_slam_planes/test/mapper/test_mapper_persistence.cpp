// SPDX-License-Identifier: BSD-3-Clause
// Planes that stay in the map although single views or a very accurate map contradict them.
#include <cmath>

#include <gtest/gtest.h>

#include "rig.h"

namespace vip_slam {
namespace {

using testing::Rig;
using testing::room;
using testing::Scene;

// From some distance such a top has only one row of points.
TEST(Mapper, ASideboardSeenFlatKeepsItsTop) {
  Scene scene = room();
  scene.add({2.6, -0.8, 0.9}, {0.4, 0, 0}, {0, 1.6, 0});
  scene.add({2.6, -0.8, 0}, {0, 1.6, 0}, {0, 0, 0.9});
  Rig rig;
  const auto look = [&](double x, double y, int k) {
    rig.look(scene, {x, y, 1.5}, {3, 0.3 * std::sin(0.52 * k), 0.95});
  };
  for (int k = 0; k < 6; ++k) look(1.2 + 0.2 * std::sin(0.4 * k), 0.5 * std::sin(0.28 * k), k);
  const PlaneEstimate* top = rig.find(Plane({0, 0, 1}, -0.9), 0.01);
  ASSERT_TRUE(top);
  const PlaneId id = top->id;
  for (int k = 0; k < 40; ++k) {
    look(-1.2 + 0.03 * k, 0.8 * std::sin(0.28 * k), k);
    top = rig.find(Plane({0, 0, 1}, -0.9), 0.01);
    ASSERT_TRUE(top) << k;
    EXPECT_EQ(top->id, id) << k;
  }
}

// With poses accurate to 0.5 mm the other walls agree far better.
TEST(Mapper, AWallThatBowsIsOneWallThatStays) {
  Scene scene;
  scene.add({-3, -2.5, 0}, {6, 0, 0}, {0, 5, 0});
  scene.add({-3, -2.5, 2.6}, {6, 0, 0}, {0, 5, 0});
  scene.add({-3, -2.5, 0}, {6, 0, 0}, {0, 0, 2.6});
  scene.add({-3, -2.5, 0}, {0, 5, 0}, {0, 0, 2.6});
  scene.add({3, -2.5, 0}, {0, 5, 0}, {0, 0, 2.6});
  constexpr int kPieces = 20;
  const auto at = [](double x) { return Eigen::Vector3d(x, 2.5 + 0.015 * (1 - x * x / 9), 0); };
  for (int k = 0; k < kPieces; ++k) {
    const Eigen::Vector3d from = at(-3 + 6.0 * k / kPieces), to = at(-3 + 6.0 * (k + 1) / kPieces);
    scene.add(from, to - from, {0, 0, 2.6});
  }
  Rig rig;
  bool found = false;
  for (int k = 0; k < 45; ++k) {
    const double turn = 0.35 * k;
    const Eigen::Vector3d eye(1.8 * std::sin(0.11 * k), 0.7 * std::sin(0.13 * k), 1.4 + 0.1 * std::sin(turn));
    const PlaneUpdate update = rig.look(scene, eye, eye + Eigen::Vector3d(std::cos(turn), std::sin(turn), -0.05));
    EXPECT_TRUE(update.removed.empty()) << k;
    const bool there = rig.find(Plane({0, -1, 0}, 2.505), 0.02) != nullptr;
    EXPECT_TRUE(there || !found) << k;
    found = found || there;
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(rig.mapper.planes().size(), 6u);
}

}  // namespace
}  // namespace vip_slam
