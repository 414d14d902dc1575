// SPDX-License-Identifier: BSD-3-Clause
// The whole plane module on exact scenes, with poses given as by a back end.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "rig.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Rig;
using testing::room;
using testing::Scene;
using testing::updateFor;

TEST(Mapper, TurningInARoomFindsSixPlanesOnce) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 14; ++i) {
    const double a = i * 30 * kDegree;
    rig.look(scene, {0.2 * std::cos(a), 0.1, 1.4}, {3 * std::cos(a), 3 * std::sin(a), i % 2 ? 0.6 : 2.2});
  }
  ASSERT_EQ(6u, rig.mapper.planes().size());
  for (const Plane& truth : {Plane({0, 0, 1}, 0), Plane({0, 0, -1}, 2.6), Plane({1, 0, 0}, 3), Plane({-1, 0, 0}, 3),
                             Plane({0, 1, 0}, 2.5), Plane({0, -1, 0}, 2.5)}) {
    const PlaneEstimate* p = rig.find(truth, 0.003);
    ASSERT_TRUE(p) << truth.coefficients().transpose();
    EXPECT_LT(angleBetween(truth, p->plane), 0.1 * kDegree);
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

TEST(Mapper, AFloorIsAsFarBelowTheOriginBeforeGravityIsKnown) {
  // Half a degree by which a map leans at first would be 3 cm of height, three metres from the origin.
  Scene scene;
  scene.add({-2, -3, -1.4}, {8, 0, 0}, {0, 6, 0});
  const SE3 T_W_C = lookAt({0, 0, 0}, {3.5, 0, -1.4});
  for (const double lean_deg : {0.0, 0.5, -0.5}) {
    const Eigen::AngleAxisd lean(lean_deg * kDegree, Eigen::Vector3d::UnitY());
    Rig rig;
    const auto keyframe = rig.camera.keyframe(scene, T_W_C);
    keyframe->frame.covariance.topLeftCorner<3, 3>() = 1e-4 * Eigen::Matrix3d::Identity();
    rig.place(keyframe, SE3(lean.toRotationMatrix(), Eigen::Vector3d::Zero()) * T_W_C);
    ASSERT_EQ(1u, rig.mapper.planes().size()) << lean_deg;
    EXPECT_NEAR(1.4, rig.mapper.planes().front().plane.d, 0.003) << lean_deg;
  }
}

TEST(Mapper, ADoorWhoseRecessDidNotShowFromAfarIsStillFound) {
  // From afar and at a flat angle the wall seems to continue across the recess, so the leaf is where wall is mapped.
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

TEST(Mapper, APlaneWaitsForASecondSightingWhileNobodyLooks) {
  Rig rig;
  Scene scene;
  scene.add({3, -0.4, 0.8}, {0, 0.8, 0}, {0, 0, 0.8});  // a board, too small to be accepted at once
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
  for (const double step : {0.05, 0.1}) {  // viewpoints count when 0.1 m apart: two are not enough, five are
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
  // The keyframes see a corner of a dark worktop, a later frame more of it.
  Scene corner, more;
  corner.add({1.0, 0, 0.9}, {0.27, 0, 0}, {0, 0.27, 0});
  more.add({1.0, 0, 0.9}, {0.6, 0, 0}, {0, 0.5, 0});
  const auto eye = [](int i) { return Eigen::Vector3d(0, 0.1 * i, 1.5); };
  PlaneMapperOptions options;
  options.support.min_area = 0.07;
  options.detection.min_keyframes = 3;
  for (const bool grown : {false, true}) {
    Rig rig(0.5, options);
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

/// A wall at x = 3 with a doorway, 1 m wide, from y = -0.5 to 0.5.
Scene wallWithDoorway() {
  Scene scene;
  scene.add({3, -3, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  scene.add({3, 0.5, 0}, {0, 2.5, 0}, {0, 0, 2.6});
  scene.add({3, -0.5, 2}, {0, 1, 0}, {0, 0, 0.6});
  return scene;
}

bool covers(const PlaneEstimate& wall, const Eigen::Vector3d& p) {
  for (const PlanePolygon& polygon : wall.polygons) {
    bool inside = false;
    for (std::size_t i = 0, j = polygon.outer.size() - 1; i < polygon.outer.size(); j = i++) {
      const Eigen::Vector3d &a = polygon.outer[i], &b = polygon.outer[j];
      if ((a.z() > p.z()) != (b.z() > p.z()) && p.y() < (b.y() - a.y()) * (p.z() - a.z()) / (b.z() - a.z()) + a.y()) {
        inside = !inside;
      }
    }
    if (inside) return true;
  }
  return false;
}

TEST(Mapper, DoorwayIsAHoleInTheWall) {
  Rig rig;
  Scene scene = wallWithDoorway();
  scene.add({5, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  for (int i = 0; i < 6; ++i) rig.look(scene, {0, -1 + 0.4 * i, 1.4}, {3, -0.6 + 0.25 * i, 1.4});
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 3), 0.01);
  ASSERT_TRUE(wall);
  EXPECT_GT(wall->area, 5);
  EXPECT_FALSE(covers(*wall, {3, 0, 1.0}));
}

// Behind it is glass, or nothing within the depth camera's range: no depth ever refutes a wall there.
TEST(Mapper, DoorwayThatShowsNoDepthStaysOpenAtImageRate) {
  Rig rig;
  const Scene scene = wallWithDoorway();
  for (int i = 0; i < 3; ++i) rig.look(scene, {-1.5, -0.3 + 0.3 * i, 1.4}, {3, -0.2 + 0.2 * i, 1.2});
  for (int i = 0; i < 12; ++i) {
    const SE3 T_W_C = lookAt({-1.5, -0.3 + 0.05 * i, 1.4}, {3, -0.2 + 0.04 * i, 1.2});
    TrackedFrame frame = rig.camera.frame(scene, T_W_C, 4 + i, 16);
    frame.keyframe = 3;
    rig.mapper.grow(frame, SE3());
  }
  rig.mapper.applyMapUpdate(MapUpdate());
  EXPECT_GE(rig.mapper.counters().frames_grown, 8u);  // some follow too closely and are skipped
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 3), 0.01);
  ASSERT_TRUE(wall);
  EXPECT_GT(wall->area, 5);
  for (const double y : {-0.2, 0.0, 0.2}) EXPECT_FALSE(covers(*wall, {3, y, 1.0})) << y;
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

TEST(Mapper, ObservationsHoldOnlyPointsOfTheirPlane) {
  Rig rig;
  Scene scene = room();
  scene.add({1.5, -0.4, 0}, {0, 0.8, 0}, {0, 0, 0.9});  // a box in front of the wall
  scene.add({1.5, -0.4, 0.9}, {0, 0.8, 0}, {0.6, 0, 0});
  scene.add({2.95, 0.6, 0.8}, {0, 1, 0}, {0, 0, 1.0});  // a picture 5 cm off the wall
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
      // However many points, the distance is not known better than what they share.
      const Eigen::Vector3d centre = o.G.topRightCorner<3, 1>() / o.G(3, 3);
      const double along = std::abs(transformPlane(T.inverse(), plane).n.dot(centre)) / centre.z();
      const double shared = rig.camera.noise.shared(centre.z()) * along;
      const double found = (1 - o.weight_scale) / o.G(3, 3);
      EXPECT_NEAR(std::sqrt(found), shared, 0.05 * shared);  // the plane was another when it was sampled
      EXPECT_GT(1 / o.G(3, 3), found);
      Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
      for (const PlaneSample& p : o.points) {
        ++points;
        const Eigen::Vector3d p_W = T * p.p_C.cast<double>();
        EXPECT_LT(std::abs(plane.signedDistance(p_W)), 4 * p.sigma) << "plane " << o.plane << " at " << p_W.transpose();
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
  const Plane optimised(Eigen::Vector3d(1, 0.01, 0), -3.01);  // with the opposite sign of normal and distance
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
  second.mapper.restore(testing::storedPlanes(first.mapper.planes()), 0);
  EXPECT_EQ(first.mapper.planes().size(), second.mapper.planes().size());
  for (int i = 0; i < 4; ++i) {
    const SE3 T = lookAt({0.2, 0.2 * i, 1.4}, {3, 0.5, 1.1});
    second.place(second.camera.keyframe(scene, T), T);
  }
  ASSERT_EQ(first.mapper.planes().size(), second.mapper.planes().size());
  for (std::size_t i = 0; i < first.mapper.planes().size(); ++i) {
    EXPECT_EQ(first.mapper.planes()[i].id, second.mapper.planes()[i].id);
    EXPECT_NEAR(first.mapper.planes()[i].area, second.mapper.planes()[i].area, 0.35 * second.mapper.planes()[i].area);
  }
}

TEST(Mapper, RestoredPlanesKeepTheirAreaHoweverManySightingsACellNeeds) {
  PlaneMapperOptions options;
  options.growth.min_hits = 3;
  Rig first(1.0, options), second(1.0, options);
  for (int i = 0; i < 5; ++i) first.look(room(), {0, 0.05 * i, 1.4}, {3, 0.2, 1.0});
  ASSERT_FALSE(first.mapper.planes().empty());
  second.mapper.restore(testing::storedPlanes(first.mapper.planes()), 5);
  second.mapper.applyMapUpdate({});
  ASSERT_EQ(first.mapper.planes().size(), second.mapper.planes().size());
  for (std::size_t i = 0; i < first.mapper.planes().size(); ++i) {
    const double area = first.mapper.planes()[i].area;
    EXPECT_NEAR(area, second.mapper.planes()[i].area, 0.1 * area + 0.1);
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

TEST(Mapper, KeyframesWaitAsLongAsTheBackEndHoldsThem) {
  Rig rig;
  const auto taken = rig.camera.keyframe(room(), lookAt({0, 0, 1.4}, {3, 0, 1.0}));
  taken->frame.depth_grid = {};
  MapUpdate update;
  for (KeyframeId id = 1; id <= kMaxWaitingKeyframes + 1; ++id) {
    const auto keyframe = std::make_shared<Keyframe>(*taken);
    keyframe->id = id;
    rig.mapper.addKeyframe(keyframe);
    update.keyframes.push_back(updateFor(*keyframe, SE3()).keyframes.front());
  }
  EXPECT_EQ(0u, rig.mapper.counters().keyframes_forgotten);
  rig.mapper.applyMapUpdate(update);
  EXPECT_EQ(kMaxWaitingKeyframes + 1, rig.mapper.counters().keyframes);
  // A keyframe that arrives when the queue is full of keyframes dropped by the back end evicts one of them.
  for (KeyframeId id = 1; id <= kMaxWaitingKeyframes + 2; ++id) {
    const auto keyframe = std::make_shared<Keyframe>(*taken);
    keyframe->id = 10000 + id;
    rig.mapper.addKeyframe(keyframe);
  }
  EXPECT_EQ(1u, rig.mapper.counters().keyframes_forgotten);
}

TEST(Mapper, PlanesStayAsTheyAreWhileTheBackEndOnlyLocalises) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 3; ++i) rig.look(scene, {0.1 * i, 0, 1.4}, {3, 0, 1.3});
  const Plane wall({-1, 0, 0}, 3);
  ASSERT_TRUE(rig.find(wall));
  const double area = rig.find(wall)->area;
  const std::uint64_t grown = rig.mapper.counters().frames_grown;
  for (int i = 1; i <= 4; ++i) {
    const SE3 T_W_C = lookAt({0.2, 0, 1.4}, {3, 0.5 * i, 1.3});
    const auto keyframe = rig.camera.keyframe(scene, T_W_C);
    rig.mapper.addKeyframe(keyframe);
    MapUpdate localised;
    localised.removed_keyframes.push_back(keyframe->id);
    const PlaneUpdate result = rig.mapper.applyMapUpdate(localised);
    EXPECT_EQ(rig.mapper.planes().size(), result.planes.size());
    EXPECT_TRUE(result.observations.empty() && result.merges.empty() && result.removed.empty());
    TrackedFrame frame = rig.camera.frame(scene, T_W_C, 10 + i, 16);
    frame.keyframe = keyframe->id;
    rig.mapper.grow(frame, SE3());
    EXPECT_EQ(area, rig.find(wall)->area);
  }
  EXPECT_EQ(grown, rig.mapper.counters().frames_grown);
  EXPECT_EQ(0u, rig.mapper.counters().keyframes_waiting);
  // Mapping goes on.
  rig.look(scene, {0.2, 0, 1.4}, {3, 2, 1.3});
  EXPECT_GT(rig.find(wall)->area, area + 0.5);
}

TEST(Mapper, PosesThatAreNoNumbersChangeNothing) {
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 3; ++i) rig.look(scene, {0, 0.2 * i, 1.4}, {3, 0, 1.0});
  const std::size_t planes = rig.mapper.planes().size();
  ASSERT_GT(planes, 0u);
  const SE3 nowhere(Eigen::Quaterniond::Identity(), {kNan, 0, 0});

  MapUpdate update;  // with NaN: a placed keyframe, a plane, a landmark
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
  // The keyframe waits for a valid pose.
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
  second.mapper.restore(testing::storedPlanes(planes), 0);
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
