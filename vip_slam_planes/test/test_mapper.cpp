// The whole plane module on exact scenes, with poses that are given as a back end would give them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "scene.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Scene;
using testing::SceneCamera;
using testing::updateFor;

class Rig {
 public:
  explicit Rig(double noise_scale = 1.0, PlaneMapperOptions options = {})
      : camera(testing::quietNoise(), noise_scale), mapper(options, camera.camera, camera.noise) {}

  PlaneUpdate look(const Scene& scene, const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
    return place(camera.keyframe(scene, lookAt(eye, target)), lookAt(eye, target));
  }
  /// A keyframe that the back end puts at T_W_C, wherever it was taken.
  PlaneUpdate place(const std::shared_ptr<Keyframe>& keyframe, const SE3& T_W_C, const MapUpdate& base = {}) {
    mapper.addKeyframe(keyframe);
    MapUpdate update = updateFor(*keyframe, T_W_C);
    update.landmarks = base.landmarks;
    update.planes = base.planes;
    poses[keyframe->id] = T_W_C;
    return mapper.applyMapUpdate(update);
  }
  const PlaneEstimate* find(const Plane& truth, double max_d = 0.02) const {
    for (const PlaneEstimate& p : mapper.planes()) {
      if (p.plane.n.dot(truth.n) > std::cos(0.02) && std::abs(p.plane.d - truth.d) < max_d) return &p;
    }
    return nullptr;
  }

  SceneCamera camera;
  PlaneMapper mapper;
  std::map<KeyframeId, SE3> poses;
};

Scene room() {
  Scene scene;
  scene.addRoom({-3, -2.5, 0}, {3, 2.5, 2.6});
  return scene;
}

TEST(Mapper, TurningInARoomFindsSixPlanesOnce) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 14; ++i) {
    const double a = i * 30 * M_PI / 180;
    rig.look(scene, {0.2 * std::cos(a), 0.1, 1.4},
             {3 * std::cos(a), 3 * std::sin(a), i % 2 ? 0.6 : 2.2});
  }
  ASSERT_EQ(6u, rig.mapper.planes().size());
  for (const Plane& truth : {Plane({0, 0, 1}, 0), Plane({0, 0, -1}, 2.6), Plane({1, 0, 0}, 3), Plane({-1, 0, 0}, 3),
                             Plane({0, 1, 0}, 2.5), Plane({0, -1, 0}, 2.5)}) {
    const PlaneEstimate* p = rig.find(truth, 0.003);
    ASSERT_TRUE(p) << truth.coefficients().transpose();
    EXPECT_LT(angleBetween(truth, p->plane), 0.1 * M_PI / 180);
    EXPECT_EQ(truth.n.z() != 0 ? PlaneKind::kHorizontal : PlaneKind::kVertical, p->kind);
    EXPECT_FALSE(p->polygons.empty());
    for (const PlanePolygon& polygon : p->polygons) {
      for (const Eigen::Vector3d& q : polygon.outer) EXPECT_NEAR(0, p->plane.signedDistance(q), 1e-9);
    }
  }
  const PlaneEstimate* wall = rig.find(Plane({1, 0, 0}, 3));
  EXPECT_GT(wall->area, 0.75 * 5 * 2.6);
  EXPECT_LT(wall->area, 1.02 * 5 * 2.6);
}

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

TEST(Mapper, ADoorWhoseRecessDidNotShowFromAfarIsStillFound) {
  // From afar and at a flat angle the wall goes on across the recess, so all of the leaf lies where the wall is known.
  Rig rig;
  Scene afar, near;
  afar.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  near.add({3, -3, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  near.add({3, 0.5, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  near.add({3.09, -0.6, 0}, {0, 1.2, 0}, {0, 0, 2.6});
  for (int i = 0; i < 3; ++i) rig.look(afar, {0.2, -1.4 + 0.4 * i, 1.4}, {3, 0, 1.2});
  for (int i = 0; i < 6; ++i) rig.look(near, {0.6, -1.0 + 0.4 * i, 1.4}, {3, 0, 1.2});
  ASSERT_EQ(2u, rig.mapper.planes().size());
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3.0), 0.004));
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3.09), 0.004));
  EXPECT_NEAR(2.6, rig.find(Plane({-1, 0, 0}, 3.09))->area, 0.5);
}

TEST(Mapper, CorridorWallSeenFromBothEndsBecomesOne) {
  Rig rig;
  Scene scene;
  scene.add({-6, 1, 0}, {12, 0, 0}, {0, 0, 2.5});
  // Each end looks at its own half first; what lies between comes last. The far end has drifted by 2.5 cm.
  const auto at = [&](double x, double target_x, double drift) {
    const SE3 truth = lookAt({x, -1, 1.3}, {target_x, 1, 1.2});
    const auto keyframe = rig.camera.keyframe(scene, truth);
    return rig.place(keyframe, SE3(truth.rotation(), truth.t() + Eigen::Vector3d(0, drift, 0)));
  };
  at(-5, -5, 0);
  at(-4.6, -4.6, 0);
  at(5, 5, 0.025);
  at(4.6, 4.6, 0.025);
  EXPECT_EQ(2u, rig.mapper.planes().size());
  const PlaneId oldest = rig.mapper.planes().front().id;
  std::vector<PlaneMerge> merges;
  for (double x = -4; x <= 4.1; x += 0.8) {
    const PlaneUpdate update = at(x, x, 0.0125 + x / 4 * 0.0125);
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

TEST(Mapper, APartitionWhoseMiddleIsHiddenIsOneButCupboardsAreTwo) {
  struct Case {
    double height, step;
    std::size_t planes;
  };
  for (const Case& c : {Case{2.0, 0.0, 1}, Case{2.0, 0.03, 2}, Case{0.9, 0.0, 2}}) {
    Rig rig(0.5);
    Scene scene;
    scene.add({-0.8, 1, 0}, {0.4, 0, 0}, {0, 0, c.height});  // 0.8 m^2
    scene.add({0.4, 1 + c.step, 0}, {0.4, 0, 0}, {0, 0, c.height});
    for (int i = 0; i < 6; ++i) rig.look(scene, {-0.5 + 0.2 * i, -1.5, 1.3}, {-0.2 + 0.1 * i, 1, 1.0});
    EXPECT_EQ(c.planes, rig.mapper.planes().size()) << c.height << " m high, " << c.step << " m apart";
  }
}

TEST(Mapper, ASmallPieceOfFloorBelongsToAFloorThatNoTableIsAsLargeAs) {
  for (const double step : {0.0, 0.04}) {
    Rig rig;
    Scene scene;
    scene.add({0, -3, 0}, {5, 0, 0}, {0, 6, 0});
    scene.add({6.5, -0.7, step}, {1.2, 0, 0}, {0, 1.4, 0});  // 1.5 m further on, 1.7 m^2
    for (double y = -2; y <= 2; y += 0.4) {
      rig.look(scene, {0.5, y, 1.4}, {2.5, y, 0});
      rig.look(scene, {2.5, y, 1.4}, {4.5, y, 0});
    }
    for (int i = 0; i < 4; ++i) rig.look(scene, {5.2, 0.1 * i, 1.4}, {7.1, 0, step});
    ASSERT_GT(rig.mapper.planes().front().area, 20.0);
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
  }
}

TEST(Mapper, ASmallPieceOfCeilingBelongsToTheCeiling) {
  for (const double step : {0.0, 0.04}) {
    Rig rig;
    Scene scene;
    scene.add({0, -1.5, 2.5}, {2, 0, 0}, {0, 3, 0});
    scene.add({6.5, -0.4, 2.5 - step}, {0.9, 0, 0}, {0, 0.9, 0});  // 4.5 m further on, 0.8 m^2
    for (double y = -1; y <= 1; y += 0.4) rig.look(scene, {-1.0, y, 1.2}, {1.0, y, 2.5});
    for (int i = 0; i < 6; ++i) rig.look(scene, {5.2, 0.1 * i - 0.2, 1.2}, {6.9, 0, 2.5 - step});
    ASSERT_GT(rig.mapper.planes().front().area, 4.0);
    EXPECT_EQ(step == 0 ? 1u : 2u, rig.mapper.planes().size()) << step;
  }
}

// Two keyframes that saw one end of it first stand a little too low.
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

TEST(Mapper, APlaneWaitsForASecondSightingWhileNobodyLooks) {
  Rig rig;
  Scene scene;
  scene.add({3, -0.4, 0.8}, {0, 0.8, 0}, {0, 0, 0.8});  // a board, too small to be sure of at once
  scene.add({-3, -2, 0}, {0, 4, 0}, {0, 0, 2.5});
  const Plane board({-1, 0, 0}, 3);
  rig.look(scene, {0, 0, 1.2}, {3, 0, 1.2});
  for (int i = 0; i < 12; ++i) rig.look(scene, {0.1 * i, 0, 1.2}, {-3, 0.1 * i, 1.2});
  EXPECT_FALSE(rig.find(board));
  rig.look(scene, {0, 0.2, 1.2}, {3, 0, 1.2});
  EXPECT_TRUE(rig.find(board));
}

TEST(Mapper, FramesFromFurtherOnConfirmAPlaneThatOneKeyframeSaw) {
  Scene scene;
  scene.add({3, -0.4, 0.8}, {0, 0.8, 0}, {0, 0, 0.8});
  for (const double step : {0.05, 0.1}) {  // two places 0.1 m apart are not enough, five are
    Rig rig;
    rig.look(scene, {0, 0, 1.2}, {3, 0, 1.2});
    for (int i = 1; i <= 5; ++i) {
      const SE3 T_W_C = lookAt({0, i * step, 1.2}, {3, 0, 1.2});
      rig.mapper.grow(rig.camera.frame(scene, T_W_C, 1 + 0.1 * i, 16), SE3());
    }
    rig.mapper.applyMapUpdate({});
    EXPECT_EQ(step > 0.07, rig.find(Plane({-1, 0, 0}, 3)) != nullptr) << step;
  }
}

TEST(Mapper, WhoHasSeenAPlaneBeforeItsStartCounts) {
  Scene corner, whole;
  corner.add({3, -0.4, 0.8}, {0, 0.4, 0}, {0, 0, 0.35});  // too little to start a plane
  whole.add({3, -0.4, 0.8}, {0, 0.8, 0}, {0, 0, 0.8});
  for (const bool before : {false, true}) {
    Rig rig;
    if (before) rig.look(corner, {0, 0, 1.2}, {3, 0, 1.2});
    EXPECT_TRUE(rig.mapper.planes().empty());
    rig.look(whole, {0, 0.1, 1.2}, {3, 0, 1.2});
    EXPECT_EQ(before, rig.find(Plane({-1, 0, 0}, 3)) != nullptr);
  }
}

TEST(Mapper, WhatKeyframesStartSmallIsPublishedWhenFramesHaveGrownIt) {
  // Of a dark worktop the keyframes see a corner, a later frame more.
  Scene corner, more;
  corner.add({1.0, 0, 0.9}, {0.34, 0, 0}, {0, 0.30, 0});
  more.add({1.0, 0, 0.9}, {0.6, 0, 0}, {0, 0.5, 0});
  const auto eye = [](int i) { return Eigen::Vector3d(0, 0.1 * i, 1.5); };
  for (const bool grown : {false, true}) {
    Rig rig(0.5);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(rig.look(corner, eye(i), {1.1, 0.1, 0.9}).planes.empty());
    EXPECT_EQ(1u, rig.mapper.counters().planes_started);
    TrackedFrame frame = rig.camera.frame(grown ? more : corner, lookAt(eye(4), {1.1, 0.1, 0.9}), 2, 16);
    frame.keyframe = 3;
    rig.mapper.grow(frame, SE3());
    rig.look(corner, eye(5), {1.1, 0.1, 0.9});
    EXPECT_EQ(grown, rig.find(Plane({0, 0, 1}, -0.9)) != nullptr);
    EXPECT_EQ(grown ? 1u : 0u, rig.mapper.planes().size());
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

TEST(Mapper, ATableAcrossTheRoomIsFoundThoughSeenAtAFlatAngle) {
  // From standing height, five metres away: 80 to 82 degrees off the normal, as one always sees the tables of a room.
  Rig rig;
  Scene scene;
  scene.addRoom({-4, -3, 0}, {6, 3, 2.6});
  scene.add({4.4, -0.8, 0.74}, {0.8, 0, 0}, {0, 1.6, 0});
  for (int i = 0; i < 5; ++i) rig.look(scene, {-0.2, -0.6 + 0.3 * i, 1.5}, {4.8, 0.1, 0.9});
  const PlaneEstimate* table = rig.find(Plane({0, 0, 1}, -0.74), 0.01);
  ASSERT_TRUE(table);
  EXPECT_GT(table->area, 0.4);  // a dozen pixels high
  EXPECT_LT(table->area, 1.5);
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

TEST(Mapper, DoorwayIsAHoleInTheWall) {
  Rig rig;
  Scene scene;
  scene.add({3, -3, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  scene.add({3, 0.5, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  scene.add({3, -0.5, 2}, {0, 1, 0}, {0, 0, 0.6});
  scene.add({5, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  for (int i = 0; i < 6; ++i) rig.look(scene, {0, -1 + 0.4 * i, 1.4}, {3, -0.6 + 0.25 * i, 1.4});
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 3), 0.01);
  ASSERT_TRUE(wall);
  const Eigen::Vector3d middle(3, 0, 1.0);
  EXPECT_GT(wall->area, 5);
  // The doorway's middle lies in no piece.
  for (const PlanePolygon& polygon : wall->polygons) {
    bool inside = false;
    for (std::size_t i = 0, j = polygon.outer.size() - 1; i < polygon.outer.size(); j = i++) {
      const Eigen::Vector3d &a = polygon.outer[i], &b = polygon.outer[j];
      if ((a.z() > middle.z()) != (b.z() > middle.z()) &&
          middle.y() < (b.y() - a.y()) * (middle.z() - a.z()) / (b.z() - a.z()) + a.y()) {
        inside = !inside;
      }
    }
    EXPECT_FALSE(inside);
  }
}

TEST(Mapper, GrowsWithFramesButStartsNothing) {
  Rig rig(0.0);
  const Scene scene = room();
  TrackedFrame frame = rig.camera.frame(scene, lookAt({0, 0, 1.4}, {3, 0, 1.2}), 0.1, 16);
  rig.mapper.grow(frame, SE3());
  EXPECT_EQ(0u, rig.mapper.counters().frames_grown);
  rig.look(scene, {0, 0, 1.4}, {3, 0, 1.3});
  rig.look(scene, {0.3, 0, 1.4}, {3, 0, 1.3});
  const double before = rig.find(Plane({-1, 0, 0}, 3))->area;
  const std::size_t count = rig.mapper.planes().size();
  const SE3 T_map_odom(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())), {1, 2, 0.3});
  for (int i = 1; i <= 6; ++i) {
    const SE3 T_W_C = lookAt({0.3, 0, 1.4}, {3, 0.35 * i, 1.3});
    frame = rig.camera.frame(scene, T_W_C, 2 + i, 16);
    frame.keyframe = 2;
    frame.state.T_W_I = T_map_odom.inverse() * T_W_C;
    rig.mapper.grow(frame, T_map_odom);
  }
  MapUpdate nothing;
  rig.mapper.applyMapUpdate(nothing);
  EXPECT_EQ(count, rig.mapper.planes().size());
  EXPECT_GT(rig.find(Plane({-1, 0, 0}, 3))->area, before + 1.0);
  EXPECT_LE(rig.find(Plane({-1, 0, 0}, 3))->area, 5 * 2.6 * 1.02);
  EXPECT_EQ(6u, rig.mapper.counters().frames_grown);
  frame.status.state = TrackingState::kLost;
  frame.state.T_W_I = SE3();
  rig.mapper.grow(frame, T_map_odom);
  EXPECT_EQ(6u, rig.mapper.counters().frames_grown);
}

TEST(Mapper, CorrectionsCarryPlanesAndAreaAlong) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 6; ++i) rig.look(scene, {-1 + 0.4 * i, 0, 1.4}, {3, -1 + 0.4 * i, 1.0});
  const std::size_t count = rig.mapper.planes().size();
  const PlaneEstimate wall = *rig.find(Plane({-1, 0, 0}, 3));
  const SE3 move(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {2, -1, 0.2});
  MapUpdate update;
  update.global = true;
  for (const auto& [id, T] : rig.poses) {
    KeyframeEstimate k;
    k.id = id;
    k.state.T_W_I = move * T;
    update.keyframes.push_back(k);
  }
  rig.mapper.applyMapUpdate(update);
  EXPECT_EQ(count, rig.mapper.planes().size());
  const Plane expected = transformPlane(move, wall.plane);
  const PlaneEstimate* moved = rig.find(expected, 0.001);
  ASSERT_TRUE(moved);
  EXPECT_EQ(wall.id, moved->id);
  EXPECT_NEAR(wall.area, moved->area, 0.1 * wall.area);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low, low2 = low, high2 = high;
  for (const auto& p : wall.polygons)
    for (const auto& q : p.outer) low = low.cwiseMin(q), high = high.cwiseMax(q);
  for (const auto& p : moved->polygons)
    for (const auto& q : p.outer) low2 = low2.cwiseMin(move.inverse() * q), high2 = high2.cwiseMax(move.inverse() * q);
  EXPECT_LT((low - low2).norm(), 0.15);
  EXPECT_LT((high - high2).norm(), 0.15);
}

TEST(Mapper, OneWallMappedTwiceBecomesOneWhenTheLoopCloses) {
  Rig rig;
  Scene scene;
  scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  // The second visit has drifted by 40 cm: two planes until the correction.
  for (int visit = 0; visit < 2; ++visit) {
    for (int i = 0; i < 3; ++i) {
      const SE3 truth = lookAt({0, -0.5 + 0.4 * i, 1.4}, {3, -0.5 + 0.4 * i, 1.3});
      const SE3 drifted(truth.rotation(), truth.t() - Eigen::Vector3d(0.4 * visit, 0, 0));
      rig.place(rig.camera.keyframe(scene, truth), drifted);
    }
  }
  ASSERT_EQ(2u, rig.mapper.planes().size());
  const PlaneId oldest = rig.mapper.planes()[0].id, newest = rig.mapper.planes()[1].id;
  MapUpdate update;
  update.global = true;
  for (const auto& [id, T] : rig.poses) {
    KeyframeEstimate k;
    k.id = id;
    k.state.T_W_I = SE3(T.rotation(), T.t() + Eigen::Vector3d(id > 3 ? 0.4 : 0.0, 0, 0));
    update.keyframes.push_back(k);
  }
  const PlaneUpdate result = rig.mapper.applyMapUpdate(update);
  ASSERT_EQ(1u, result.planes.size());
  ASSERT_EQ(1u, result.merges.size());
  EXPECT_EQ(newest, result.merges[0].from);
  EXPECT_EQ(oldest, result.merges[0].into);
  EXPECT_NEAR(3.0, result.planes[0].plane.d, 0.004);
}

TEST(Mapper, APlaneThatIsGoneDisappears) {
  Rig rig;
  Scene with = room(), without = room();
  with.add({1, -0.8, 0}, {0, 1.6, 0}, {0, 0, 1.8});  // a partition that is carried away
  for (int i = 0; i < 3; ++i) rig.look(with, {-1.5, 0.1 * i, 1.2}, {1, 0, 1.0});
  const PlaneEstimate* partition = rig.find(Plane({-1, 0, 0}, 1));
  ASSERT_TRUE(partition);
  const PlaneId id = partition->id;
  std::set<PlaneId> removed;
  for (int i = 0; i < 10; ++i) {
    const PlaneUpdate update = rig.look(without, {-1.5, 0.1 * i, 1.2}, {1, 0, 1.0});
    removed.insert(update.removed.begin(), update.removed.end());
  }
  EXPECT_FALSE(rig.find(Plane({-1, 0, 0}, 1)));
  EXPECT_EQ(std::set<PlaneId>{id}, removed);
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 3)));
}

TEST(Mapper, ObservationsHoldOnlyPointsOfTheirPlane) {
  Rig rig;
  Scene scene = room();
  scene.add({1.5, -0.4, 0}, {0, 0.8, 0}, {0, 0, 0.9});   // a box before the wall
  scene.add({1.5, -0.4, 0.9}, {0, 0.8, 0}, {0.6, 0, 0});
  scene.add({2.95, 0.6, 0.8}, {0, 1, 0}, {0, 0, 1.0});   // a picture 5 cm off the wall
  std::size_t observations = 0, points = 0;
  for (int i = 0; i < 5; ++i) {
    const SE3 T_W_C = lookAt({-1.5, -0.6 + 0.3 * i, 1.5}, {3, 0.2, 0.9});
    const PlaneUpdate update = rig.place(rig.camera.keyframe(scene, T_W_C), T_W_C);
    for (const PlaneObservation& o : update.observations) {
      ++observations;
      Plane plane;
      for (const PlaneEstimate& p : update.planes) {
        if (p.id == o.plane) plane = p.plane;
      }
      const SE3& T = rig.poses.at(o.keyframe);
      EXPECT_LE(o.points.size(), 200u);
      EXPECT_LE(o.weight_scale * double(o.points.size()), 50.001);
      Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
      for (const PlanePoint& p : o.points) {
        ++points;
        const Eigen::Vector3d p_W = T * p.p_C.cast<double>();
        EXPECT_LT(std::abs(plane.signedDistance(p_W)), 4 * p.sigma) << "plane " << o.plane << " at " << p_W.transpose();
        EXPECT_GE(p.sigma, float(rig.camera.noise.bias_floor));
        const Eigen::Vector4d h = p.p_C.homogeneous().cast<double>();
        G += o.weight_scale / (double(p.sigma) * double(p.sigma)) * h * h.transpose();
      }
      EXPECT_LT((G - o.G).norm(), 1e-6 * G.norm());
    }
  }
  EXPECT_GE(observations, 12u);
  EXPECT_GE(points, 600u);
}

TEST(Mapper, OptimisedParametersReplaceOursAndPolygonsFollow) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 3; ++i) rig.look(scene, {0, 0.2 * i, 1.4}, {3, 0, 1.0});
  const PlaneEstimate wall = *rig.find(Plane({-1, 0, 0}, 3));
  MapUpdate update;
  const Plane optimised(Eigen::Vector3d(1, 0.01, 0), -3.01);  // on the other gauge
  update.planes.emplace_back(wall.id, optimised);
  rig.mapper.applyMapUpdate(update);
  const PlaneEstimate* moved = rig.find(optimised.flipped(), 1e-9);
  ASSERT_TRUE(moved);
  EXPECT_EQ(wall.id, moved->id);
  for (const auto& p : moved->polygons)
    for (const auto& q : p.outer) EXPECT_NEAR(0, optimised.signedDistance(q), 1e-9);
}

TEST(Mapper, RestoredPlanesAreRecognised) {
  Rig first;
  const Scene scene = room();
  for (int i = 0; i < 4; ++i) first.look(scene, {0, 0.2 * i, 1.4}, {3, 0.2, 1.0});
  Rig second;
  second.mapper.restore(first.mapper.planes());
  EXPECT_EQ(first.mapper.planes().size(), second.mapper.planes().size());
  for (int i = 0; i < 4; ++i) second.look(scene, {0.2, 0.2 * i, 1.4}, {3, 0.5, 1.1});
  ASSERT_EQ(first.mapper.planes().size(), second.mapper.planes().size());
  for (std::size_t i = 0; i < first.mapper.planes().size(); ++i) {
    EXPECT_EQ(first.mapper.planes()[i].id, second.mapper.planes()[i].id);
    EXPECT_NEAR(first.mapper.planes()[i].area, second.mapper.planes()[i].area, 0.35 * second.mapper.planes()[i].area);
  }
}

TEST(Mapper, RemovedKeyframesLeaveTheirArea) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 6; ++i) rig.look(scene, {-1 + 0.3 * i, 0, 1.4}, {3, -1.2 + 0.4 * i, 1.0});
  const double area = rig.find(Plane({-1, 0, 0}, 3))->area;
  MapUpdate update;
  update.removed_keyframes = {1, 2, 4};
  rig.mapper.applyMapUpdate(update);
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3), 0.004));
  EXPECT_NEAR(area, rig.find(Plane({-1, 0, 0}, 3))->area, 1e-9);
}

bool allFinite(const std::vector<PlaneEstimate>& planes) {
  return std::all_of(planes.begin(), planes.end(), [](const PlaneEstimate& p) {
    return p.plane.n.allFinite() && std::isfinite(p.plane.d) && std::isfinite(p.area) && p.area < 1e4;
  });
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Mapper, AKeyframeSentAgainCountsOnce) {
  Rig rig;
  const auto keyframe = rig.camera.keyframe(room(), lookAt({0, 0, 1.4}, {3, 0, 1.0}));
  for (int i = 0; i < 3; ++i) rig.place(keyframe, lookAt({0, 0, 1.4}, {3, 0, 1.0}));
  EXPECT_EQ(1u, rig.mapper.counters().keyframes);
  EXPECT_EQ(0u, rig.mapper.counters().keyframes_waiting);
}

TEST(Mapper, PosesThatAreNoNumbersChangeNothing) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 3; ++i) rig.look(scene, {0, 0.2 * i, 1.4}, {3, 0, 1.0});
  const std::size_t planes = rig.mapper.planes().size();
  ASSERT_GT(planes, 0u);
  const SE3 nowhere(Eigen::Quaterniond::Identity(), {kNan, 0, 0});

  MapUpdate update;  // of a keyframe that is placed, of a plane, of a landmark
  update.keyframes.push_back({1, {}});
  update.keyframes.back().state.T_W_I = nowhere;
  for (const PlaneEstimate& p : rig.mapper.planes()) {
    Plane broken = p.plane;
    broken.n.x() = kNan;
    update.planes.emplace_back(p.id, broken);
  }
  rig.mapper.applyMapUpdate(update);
  TrackedFrame frame = rig.camera.frame(scene, lookAt({0.5, 0, 1.4}, {3, 0, 1.0}), 10, 16);
  frame.keyframe = 1;
  rig.mapper.grow(frame, nowhere);
  EXPECT_EQ(0u, rig.mapper.counters().frames_grown);
  const auto keyframe = rig.camera.keyframe(scene, lookAt({0, 0.6, 1.4}, {3, 0, 1.0}));
  rig.place(keyframe, nowhere);
  EXPECT_EQ(planes, rig.mapper.planes().size());
  EXPECT_TRUE(allFinite(rig.mapper.planes()));
  // The keyframe waits for a pose that is one.
  EXPECT_EQ(1u, rig.mapper.counters().keyframes_waiting);
  rig.mapper.applyMapUpdate(updateFor(*keyframe, lookAt({0, 0.6, 1.4}, {3, 0, 1.0})));
  EXPECT_EQ(4u, rig.mapper.counters().keyframes);
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 3)));
}

TEST(Mapper, DepthGridsThatContradictThemselvesAreRefused) {
  Rig rig;
  const Scene scene = room();
  const SE3 T = lookAt({0, 0, 1.4}, {3, 0, 1.0});
  rig.look(scene, {0, 0.2, 1.4}, {3, 0, 1.0});
  for (int fault = 0; fault < 3; ++fault) {
    const auto break_it = [fault](DepthGrid* grid) {
      if (fault == 0) grid->z.resize(grid->z.size() / 2);
      if (fault == 1) grid->stride = 0;
      if (fault == 2) grid->cols = -grid->cols, grid->rows = -grid->rows;
    };
    const auto keyframe = rig.camera.keyframe(scene, T);
    break_it(&keyframe->frame.depth_grid);
    rig.place(keyframe, T);
    EXPECT_EQ(1u, rig.mapper.counters().keyframes) << fault;
    TrackedFrame frame = rig.camera.frame(scene, T, 10, 16);
    frame.keyframe = 1;
    break_it(&frame.depth_grid);
    rig.mapper.grow(frame, SE3());
    EXPECT_EQ(0u, rig.mapper.counters().frames_grown) << fault;
  }
}

TEST(Mapper, LoadedPlanesWithoutAreaGoAndTheBackEndHearsOfIt) {
  Rig first, second;
  for (int i = 0; i < 4; ++i) first.look(room(), {0, 0.2 * i, 1.4}, {3, 0.2, 1.0});
  std::vector<PlaneEstimate> planes = first.mapper.planes();
  const std::size_t sound = planes.size();
  ASSERT_GT(sound, 0u);
  for (const PlaneId id : {100, 101, 102}) planes.push_back(planes.front()), planes.back().id = id;
  planes[sound].polygons.clear();
  planes[sound + 1].polygons.front().outer[1].y() = kNan;
  planes[sound + 2].plane.d = kNan;
  second.mapper.restore(planes);
  EXPECT_EQ(sound, second.mapper.planes().size());
  const PlaneUpdate update = second.mapper.applyMapUpdate({});
  EXPECT_EQ((std::vector<PlaneId>{100, 101, 102}), update.removed);
  EXPECT_EQ(sound, second.mapper.planes().size());
  EXPECT_TRUE(allFinite(second.mapper.planes()));
}

TEST(Mapper, BadInput) {
  const auto camera = testing::testCamera();
  EXPECT_THROW(PlaneMapper({}, nullptr, testing::quietNoise()), std::invalid_argument);
  DepthNoise noise = testing::quietNoise();
  noise.max_range = 0;
  EXPECT_THROW(PlaneMapper({}, camera, noise), std::invalid_argument);
  PlaneMapper mapper({}, camera, testing::quietNoise());
  mapper.addKeyframe(nullptr);
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = 1;
  mapper.addKeyframe(keyframe);  // no depth, no features
  EXPECT_TRUE(mapper.applyMapUpdate(updateFor(*keyframe, SE3())).planes.empty());
  EXPECT_EQ(1u, mapper.counters().keyframes);
}

}  // namespace
}  // namespace vip_slam
