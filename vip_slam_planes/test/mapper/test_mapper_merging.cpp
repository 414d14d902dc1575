// SPDX-License-Identifier: BSD-3-Clause
// Which pieces the plane module merges into one surface, on exact scenes.
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "rig.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/merging/plane_merging.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Rig;
using testing::Scene;

TEST(Mapper, DoorBeforeTheWallStaysTwoWhateverTheView) {
  Rig rig;
  Scene scene;
  scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  scene.add({2.88, -0.5, 0}, {0, 1, 0}, {0, 0, 2.1});
  for (int i = 0; i < 8; ++i) rig.look(scene, {0.2, -1.4 + 0.4 * i, 1.4}, {3, 0.3 * (i - 4), 1.2});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3.0), 0.004));
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 2.88), 0.004));
  EXPECT_NEAR(2.1, rig.find(Plane({-1, 0, 0}, 2.88))->area, 0.35);
}

// At almost six metres depth noise is as large as the distance of the door from its wall, so that one plane starts that
// leans across both.
TEST(Mapper, ADoorThatNoiseMadeOneWithItsWallIsOfItsOwnFromNear) {
  DepthNoise noise = testing::quietNoise();
  noise.a = 0.001, noise.b = 0, noise.c = 0.0035, noise.max_range = 6;
  Scene scene;
  scene.add({3, -2, 0}, {0, 5.95, 0}, {0, 0, 3});
  scene.add({2.88, 0, 0}, {0, 0.95, 0}, {0, 0, 2.1});
  for (int walk = 0; walk < 3; ++walk) {
    Rig rig(noise);
    const double y = -1.6 + 0.4 * walk;
    for (int i = 0; i <= 8; ++i) rig.look(scene, {-2.75 + 0.35 * i, y, 1.5}, {3, 0.06 * i, 1.2});
    ASSERT_EQ(2u, rig.mapper.planes().size()) << walk;
    const PlaneEstimate* door = rig.find(Plane({-1, 0, 0}, 2.88), 0.01);
    ASSERT_TRUE(door) << walk;
    EXPECT_LT(door->area, 2.4) << walk;
    EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 3.0), 0.006)) << walk;
  }
}

TEST(Mapper, WhatNoiseLetInIsTakenAwayByOneNearView) {
  DepthNoise noise = testing::quietNoise();
  noise.a = 0.001, noise.b = 0, noise.c = 0.0035, noise.max_range = 6;
  Rig rig(noise);
  Scene afar, near;
  afar.add({3, -1.5, 0}, {0, 3, 0}, {0, 0, 2.5});
  near.add({3, -1.5, 0}, {0, 1.0, 0}, {0, 0, 2.5});
  near.add({3, 0.5, 0}, {0, 1.0, 0}, {0, 0, 2.5});
  near.add({3.5, -0.8, 0}, {0, 1.6, 0}, {0, 0, 2.5});  // a niche that was not visible before
  for (int i = 0; i < 6; ++i) rig.look(afar, {-2.2, -0.5 + 0.2 * i, 1.3}, {3, 0, 1.25});
  const Plane wall({-1, 0, 0}, 3);
  ASSERT_TRUE(rig.find(wall, 0.03));
  EXPECT_GT(rig.find(wall, 0.03)->area, 6.5);
  rig.look(near, {0.6, 0, 1.3}, {3, 0, 1.25});
  EXPECT_LT(rig.find(wall, 0.03)->area, 6.0);
}

// At long range noise hides the step; a wall that has absorbed the board has to give it up later.
TEST(Mapper, ABoardOnTheWallIsASurfaceOfItsOwnWhereItShows) {
  for (const double step : {0.0, 0.045}) {
    DepthNoise noise = testing::quietNoise();
    noise.c = 0.002;
    Rig rig(noise);
    Scene scene;
    scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
    scene.add({3 - step, -1.2, 1.0}, {0, 2.4, 0}, {0, 0, 1.0});
    for (int i = 0; i < 4; ++i) rig.look(scene, {-3.0 + 0.2 * i, -0.4 + 0.2 * i, 1.4}, {3, 0.1 * i, 1.3});
    EXPECT_EQ(1u, rig.mapper.planes().size()) << step;
    for (int i = 0; i < 10; ++i) rig.look(scene, {0.3 + 0.04 * i, -1.2 + 0.25 * i, 1.4}, {3, 0.1 * i - 0.3, 1.3});
    ASSERT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size());
    ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3.0), 0.006));
    if (step == 0) continue;
    ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3.0 - step), 0.006));
    EXPECT_NEAR(2.4, rig.find(Plane({-1, 0, 0}, 3.0 - step), 0.006)->area, 0.4);
  }
}

// Depth that is off as a whole, now this way, now that: all images count, and the wall is where their mean is. Of a
// camera that is known not to err so, those that differ show another surface, in front of which the first one is gone.
TEST(Mapper, AWallThatImagesShowAtSeveralDistancesIsOneWhereDepthErrsAsAWhole) {
  for (const double shared : {0.0, 1.0}) {
    DepthNoise noise = testing::quietNoise();
    noise.c = 0.004;  // 4 cm at 3 m
    Rig rig(noise);
    Scene scene;
    scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
    for (int i = 0; i < 12; ++i) {
      const SE3 T_W_C = lookAt({0, -0.6 + 0.1 * i, 1.4}, {3, 0.1 * i - 0.5, 1.3});
      const auto keyframe = rig.camera.keyframe(scene, T_W_C);
      keyframe->depth_noise.shared = shared;
      const float off = i % 4 < 2 ? 0.06f : -0.06f;
      for (float& z : keyframe->frame.depth_grid.z) z += z > 0 ? off : 0.0f;
      rig.place(keyframe, T_W_C);
    }
    EXPECT_EQ(1u, rig.mapper.planes().size()) << shared;
    EXPECT_EQ(shared > 0, rig.find(Plane({-1, 0, 0}, 3.0), 0.015) != nullptr) << shared;
  }
}

TEST(Mapper, CorridorWallSeenFromBothEndsBecomesOne) {
  Rig rig;
  Scene scene;
  scene.add({-6, 1, 0}, {12, 0, 0}, {0, 0, 2.5});
  // Each half is seen first from its own end, the part in between last. The far end has drifted by 4.5 cm.
  const auto at = [&](double x, double target_x, double drift) {
    const SE3 truth = lookAt({x, -1, 1.3}, {target_x, 1, 1.2});
    const auto keyframe = rig.camera.keyframe(scene, truth);
    return rig.place(keyframe, SE3(truth.rotation(), truth.t() + Eigen::Vector3d(0, drift, 0)));
  };
  at(-5, -5, 0);
  at(-4.6, -4.6, 0);
  at(5, 5, 0.045);
  at(4.6, 4.6, 0.045);
  EXPECT_EQ(2u, rig.mapper.planes().size());
  const PlaneId oldest = rig.mapper.planes().front().id;
  std::vector<PlaneMerge> merges;
  for (double x = -4; x <= 4.1; x += 0.8) {
    const PlaneUpdate update = at(x, x, 0.0225 + x / 4 * 0.0225);
    merges.insert(merges.end(), update.merges.begin(), update.merges.end());
  }
  ASSERT_EQ(1u, rig.mapper.planes().size());
  EXPECT_EQ(oldest, rig.mapper.planes().front().id);
  ASSERT_EQ(1u, merges.size());
  EXPECT_EQ(oldest, merges.front().into);
  EXPECT_GT(rig.mapper.planes().front().area, 20);
}

TEST(Mapper, FarPiecesOfOneWallAreOneButNotThoseOfTwo) {
  for (const double step : {0.0, 0.05}) {
    Rig rig;
    Scene scene;
    scene.add({-7, 1, 0}, {3, 0, 0}, {0, 0, 2.5});
    scene.add({4, 1 + step, 0}, {3, 0, 0}, {0, 0, 2.5});  // eight metres further on
    for (int i = 0; i < 4; ++i) rig.look(scene, {-6 + 0.3 * i, -1.5, 1.3}, {-6 + 0.4 * i, 1, 1.2});
    for (int i = 0; i < 4; ++i) rig.look(scene, {5 + 0.3 * i, -1.5, 1.3}, {5 + 0.4 * i, 1, 1.2});
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
    ASSERT_TRUE(rig.find(Plane({0, -1, 0}, 1), 0.004)) << step;
    if (step == 0) EXPECT_GE(rig.find(Plane({0, -1, 0}, 1))->polygons.size(), 2u);
  }
}

TEST(Mapper, TheLargerThePiecesTheFurtherTheyMayHaveDriftedApart) {
  // 3 cm of drift between two pieces of one wall, 3 m apart.
  for (const bool large : {true, false}) {
    const double length = large ? 3 : 1.2, height = large ? 2.5 : 0.8;
    Rig rig(0.3);
    Scene scene;
    scene.add({-1 - length, 1, 0.5}, {length, 0, 0}, {0, 0, height});
    scene.add({2, 1.03, 0.5}, {length, 0, 0}, {0, 0, height});
    for (int i = 0; i < 4; ++i) rig.look(scene, {-2.8 + 0.3 * i, -1.5, 1.3}, {-2.8 + 0.3 * i, 1, 1.2});
    for (int i = 0; i < 4; ++i) rig.look(scene, {3.2 + 0.3 * i, -1.5, 1.3}, {3.2 + 0.3 * i, 1, 1.2});
    EXPECT_EQ(large ? 1u : 2u, rig.mapper.planes().size()) << large;
  }
}

TEST(Mapper, TheFurtherApartTheBetterPiecesOfOneWallMustAgree) {
  for (const double step : {0.0, 0.018}) {
    Rig rig(0.3);
    Scene scene;
    scene.add({-4, 1, 0}, {3, 0, 0}, {0, 0, 2.5});
    scene.add({4.2, 1 + step, 0}, {0.6, 0, 0}, {0, 0, 2.1});  // 5.2 m further on, 1.26 m^2
    for (int i = 0; i < 4; ++i) rig.look(scene, {-2.5 + 0.3 * i, -1.5, 1.3}, {-2.5 + 0.3 * i, 1, 1.2});
    for (int i = 0; i < 4; ++i) rig.look(scene, {4.3 + 0.1 * i, -1.5, 1.3}, {4.5, 1, 1.1});
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
  }
}

// Two pieces of a wall, 1 m apart and seen from 6 m, that differ by 3 to 6 cm and 1 degree: equal for a camera with 13
// cm of depth noise there that a whole surface shares, but not for one whose noise averages out. A step of 20 cm is
// different for both.
TEST(Mapper, PiecesThatDifferByWhatNoiseExplainsAreOneWall) {
  DepthNoise noisy = testing::quietNoise();
  noisy.a = 0.001, noisy.b = 0, noisy.c = 0.0036, noisy.max_range = 6.5;
  const auto planes = [](const DepthNoise& noise, double shared, double step) {
    Rig rig(noise);
    rig.camera.parts.shared = shared;
    Scene scene;
    scene.add({3, -4.5, 0}, {0, 3.5, 0}, {0, 0, 2.5});
    scene.add({3 + step, 0.0, 0}, {0.03, 1.6, 0}, {0, 0, 2.5});
    for (int i = 0; i < 5; ++i) rig.look(scene, {-2.8, -2.0 + 0.2 * i, 1.3}, {3, -2.4 + 0.2 * i, 1.2});
    for (int i = 0; i < 3; ++i) rig.look(scene, {-2.8, 0.4 + 0.2 * i, 1.3}, {3, 1.6 + 0.2 * i, 1.2});
    return rig.mapper.planes().size();
  };
  EXPECT_EQ(1u, planes(noisy, 1, 0.03));
  EXPECT_EQ(2u, planes(noisy, 1, 0.2));
  EXPECT_EQ(2u, planes(noisy, 0, 0.03));
  EXPECT_EQ(2u, planes(testing::quietNoise(), 0, 0.03));
}

// A piece between a wall and a door 20 cm behind it, seen from afar: noise would allow that it belongs to either.
TEST(Mapper, APieceThatSuitsTwoPlanesGoesToTheOneThatItSuitsBetter) {
  DepthNoise noisy = testing::quietNoise();
  noisy.a = 0.001, noisy.b = 0, noisy.c = 0.0036, noisy.max_range = 6.5;
  Rig rig(noisy);
  rig.camera.parts.shared = 0.3;
  Scene door, wall, piece;
  door.add({3.2, 1.35, 0}, {0, 0.95, 0}, {0, 0, 2.5});
  wall.add({3, -4.5, 0}, {0, 3.5, 0}, {0, 0, 2.5});
  piece.add({3.053, -0.6, 0}, {0, 1.6, 0}, {0, 0, 2.5});
  for (int i = 0; i < 3; ++i) rig.look(door, {0.5, 1.6 + 0.2 * i, 1.3}, {3, 1.8, 1.2});
  for (int i = 0; i < 4; ++i) rig.look(wall, {0.5, -3.2 + 0.4 * i, 1.3}, {3, -3.2 + 0.4 * i, 1.2});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  for (int i = 0; i < 3; ++i) rig.look(piece, {-2.8, 0.2 * i, 1.3}, {3, 0.2 * i, 1.2});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  EXPECT_LT(rig.mapper.planes()[0].area, 3.0) << "the door";
  EXPECT_GT(rig.mapper.planes()[1].area, 9.0) << "the wall";
}

TEST(Mapper, ASmallPieceOfAWallBelongsToItWhenItIsOnItsPlane) {
  for (const double step : {0.0, 0.04}) {
    Rig rig;
    Scene scene;
    scene.add({-4, 1, 0}, {3, 0, 0}, {0, 0, 1.4});
    scene.add({0.8, 1 + step, 0}, {0.4, 0, 0}, {0, 0, 1.4});  // 1.8 m further on, 0.56 m^2
    for (int i = 0; i < 4; ++i) rig.look(scene, {-2.5 + 0.2 * i, -1.5, 1.3}, {-2.5 + 0.2 * i, 1, 0.9});
    for (int i = 0; i < 4; ++i) rig.look(scene, {1 + 0.1 * i, -1.2, 1.3}, {1.2, 1, 0.9});
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
  }
}

// Whatever stands between them or can be seen there: walls go on behind doors and cupboards.
TEST(Mapper, TheLeavesOfAPartitionAreOneWhenTheyAreOnOnePlane) {
  for (const double step : {0.0, 0.05}) {
    Rig rig(0.5);
    Scene scene;
    scene.add({-0.8, 1, 0}, {0.4, 0, 0}, {0, 0, 2.0});  // 0.8 m^2
    scene.add({0.4, 1 + step, 0}, {0.4, 0, 0}, {0, 0, 2.0});
    for (int i = 0; i < 6; ++i) rig.look(scene, {-0.5 + 0.2 * i, -1.5, 1.3}, {-0.2 + 0.1 * i, 1, 1.0});
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
  }
}

// Frozen depth refutes a ceiling until none of its area is left.
TEST(SameSurface, WhatHasNoAreaLeftIsNoPieceOfAnything) {
  Rig rig;
  PlaneTrack strip(1, PlaneKind::kHorizontal, Plane({0, 0, -1}, 2.6), {0, 0, 2.6}, 0.1);
  PlaneTrack gone(2, PlaneKind::kHorizontal, Plane({0, 0, -1}, 2.6), {0, 0, 2.6}, 0.1);
  for (int x = 0; x < 100; ++x)
    for (int y = 0; y < 3; ++y) strip.coverCell({x, y}, 1, 1, SE3());
  gone.coverCell({120, 1}, 1, 1, SE3());
  gone.miss({120, 1});
  OpenGaps gaps;
  const std::map<KeyframeId, KeyframePtr> keyframes;
  const CameraPoses poses;
  const PlaneViews views{keyframes, poses, rig.camera.noise, {}};
  const SceneView view{views, *rig.camera.camera, 0.1, gaps};
  EXPECT_TRUE(gone.cells().empty());
  EXPECT_FALSE(sameSurface(strip, gone, view, PlaneMergingOptions()));
}

TEST(OpenGaps, GoWithTheirPlanes) {
  OpenGaps gaps;
  gaps.add(5, 2);
  gaps.add(7, 5);
  EXPECT_TRUE(gaps.has(2, 5));
  gaps.rename(5, 3);
  EXPECT_FALSE(gaps.has(2, 5));
  EXPECT_TRUE(gaps.has(3, 2));
  EXPECT_TRUE(gaps.has(3, 7));
  gaps.rename(3, 2);  // planes seen as separate were merged nevertheless
  EXPECT_TRUE(gaps.has(2, 7));
  gaps.remove(7);
  EXPECT_FALSE(gaps.has(2, 7));
}

TEST(Mapper, BothFacesOfAThinWallAreTwo) {
  Rig rig;
  Scene scene;
  scene.add({0, -2, 0}, {0, 4, 0}, {0, 0, 2.5});
  scene.add({0.08, -2, 0}, {0, 4, 0}, {0, 0, 2.5});
  for (int i = 0; i < 3; ++i) rig.look(scene, {-2, 0.2 * i, 1.3}, {0, 0, 1.3});
  for (int i = 0; i < 3; ++i) rig.look(scene, {2, 0.2 * i, 1.3}, {0, 0, 1.3});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 0), 0.004));
  EXPECT_TRUE(rig.find(Plane({1, 0, 0}, -0.08), 0.004));
}

/// The second visit has drifted by 40 cm: two planes until the correction.
void visitTwice(const Scene& scene, Rig* rig) {
  for (int visit = 0; visit < 2; ++visit) {
    for (int i = 0; i < 3; ++i) {
      const SE3 truth = lookAt({0, -0.5 + 0.4 * i, 1.4}, {3, -0.5 + 0.4 * i, 1.3});
      const SE3 drifted(truth.rotation(), truth.t() - Eigen::Vector3d(0.4 * visit, 0, 0));
      rig->place(rig->camera.keyframe(scene, truth), drifted);
    }
  }
}

/// Removes the drift, but places some keyframes half a metre off.
MapUpdate closing(const Rig& rig, const std::set<KeyframeId>& astray) {
  MapUpdate update;
  update.global = true;
  for (const auto& [id, T] : rig.poses) {
    KeyframeEstimate k;
    k.id = id;
    k.state.T_W_I = SE3(T.rotation(), T.t() + Eigen::Vector3d((id > 3 ? 0.4 : 0.0) - 0.5 * astray.count(id), 0, 0));
    update.keyframes.push_back(k);
  }
  return update;
}

TEST(Mapper, OneWallMappedTwiceBecomesOneWhenTheLoopCloses) {
  Rig rig;
  Scene scene;
  scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  visitTwice(scene, &rig);
  ASSERT_EQ(2u, rig.mapper.planes().size());
  const PlaneId oldest = rig.mapper.planes()[0].id, newest = rig.mapper.planes()[1].id;
  const PlaneUpdate result = rig.mapper.applyMapUpdate(closing(rig, {}));
  ASSERT_EQ(1u, result.planes.size());
  ASSERT_EQ(1u, result.merges.size());
  EXPECT_EQ(newest, result.merges[0].from);
  EXPECT_EQ(oldest, result.merges[0].into);
  EXPECT_NEAR(3.0, result.planes[0].plane.d, 0.004);
}

// One keyframe of either visit is not corrected like the others, so that its observation is no longer on the wall. The
// back end transfers it when the planes merge, and must be told to withdraw it.
TEST(Mapper, WhatNoLongerHoldsIsWithdrawnFromThePlaneThatItsPlaneBecame) {
  for (const KeyframeId astray : {KeyframeId(2), KeyframeId(5)}) {
    Rig rig;
    Scene scene;
    scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
    visitTwice(scene, &rig);
    ASSERT_EQ(2u, rig.mapper.planes().size());
    const PlaneId oldest = rig.mapper.planes()[0].id;
    MapUpdate update = closing(rig, {astray});
    for (const PlaneEstimate& plane : rig.mapper.planes()) update.planes.emplace_back(plane.id, Plane({-1, 0, 0}, 3));
    const PlaneUpdate result = rig.mapper.applyMapUpdate(update);
    ASSERT_EQ(1u, result.merges.size()) << astray;
    EXPECT_EQ(oldest, result.merges[0].into);
    bool withdrawn = false;
    for (const PlaneObservation& o : result.observations) {
      withdrawn = withdrawn || (o.keyframe == astray && o.plane == oldest && o.points.empty());
    }
    EXPECT_TRUE(withdrawn) << astray;
  }
}

}  // namespace
}  // namespace vip_slam
