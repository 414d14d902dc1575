// SPDX-License-Identifier: BSD-3-Clause
// Corrections by the back end, on exact scenes: poses, extrinsics, intrinsics and depth offset.
#include <cmath>
#include <set>

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

/// Expects all observations in `result` to be of one keyframe at T_W_C, with `correction`, and on their planes.
void expectCorrectedObservations(const PlaneUpdate& result, const SE3& T_W_C, const CameraCorrection& correction) {
  ASSERT_FALSE(result.observations.empty());
  for (const PlaneObservation& o : result.observations) {
    EXPECT_EQ(o.camera_correction, correction);
    const PlaneEstimate* plane = nullptr;
    for (const PlaneEstimate& p : result.planes) plane = p.id == o.plane ? &p : plane;
    ASSERT_TRUE(plane);
    const Eigen::Vector4d p_C = transformPlane(T_W_C.inverse(), plane->plane).coefficients();
    EXPECT_LT(std::sqrt(p_C.dot(o.G * p_C) / o.G(3, 3)), 0.004);
  }
}

TEST(Mapper, KeyframesLookFromTheExtrinsicsThatAreKnownNow) {
  // The front end's extrinsics were 3 degrees off when it made the keyframes; the back end has corrected them.
  Rig rig;
  const Scene scene = room();
  const SE3 T_I_C(expQuaternion({0.2, -0.1, 0.3}), {0.05, 0.02, 0});
  for (int i = 0; i < 6; ++i) {
    const SE3 T_W_C = lookAt({-1 + 0.4 * i, 0, 1.4}, {3, -1 + 0.4 * i, 1.0});
    const std::shared_ptr<Keyframe> keyframe = rig.camera.keyframe(scene, T_W_C);
    keyframe->frame.T_I_C = T_I_C * SE3(expQuaternion({0.03, 0.04, 0}), {0.1, 0, 0});
    keyframe->frame.state.T_W_I = T_W_C * keyframe->frame.T_I_C.inverse();
    rig.mapper.addKeyframe(keyframe);
    MapUpdate update = updateFor(*keyframe, T_W_C * T_I_C.inverse());
    update.keyframes[0].T_I_C = T_I_C;
    rig.mapper.applyMapUpdate(update);
  }
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 3), 0.003);
  ASSERT_TRUE(wall);
  EXPECT_LT(angleBetween(Plane({-1, 0, 0}, 3), wall->plane), 0.1 * kDegree);
}

TEST(Mapper, DepthThatWasTooLongIsCorrectedInAllKeyframes) {
  // Depth reads 2 cm too long at first; the back end reports the error with the sixth keyframe.
  Rig rig;
  const Scene scene = room();
  const Plane truth({-1, 0, 0}, 3);
  MapUpdate all;
  all.global = true;
  for (int i = 0; i < 6; ++i) {
    const SE3 T_W_C = lookAt({-1 + 0.2 * i, 0, 1.4}, {3, -1 + 0.4 * i, 1.0});
    const std::shared_ptr<Keyframe> keyframe = rig.camera.keyframe(scene, T_W_C);
    for (float& z : keyframe->frame.depth_grid.z) z += z > 0 ? 0.02f : 0.0f;
    for (Feature& f : keyframe->frame.features) f.depth += f.depth > 0 ? 0.02f : 0.0f;
    rig.place(keyframe, T_W_C);
    all.keyframes.push_back(updateFor(*keyframe, T_W_C).keyframes[0]);
    all.keyframes.back().camera_correction.offset = -0.02;
  }
  const PlaneEstimate* wall = rig.find(truth, 0.05);
  ASSERT_TRUE(wall);
  EXPECT_GT(std::abs(wall->plane.d - truth.d), 0.01);
  rig.mapper.applyMapUpdate(all);
  EXPECT_TRUE(rig.find(truth, 0.002));
  // A keyframe placed after the error is known is corrected as well, and its observations state the correction.
  const SE3 T_W_C = lookAt({0.3, 0.1, 1.4}, {3, 0.2, 1.1});
  const std::shared_ptr<Keyframe> keyframe = rig.camera.keyframe(scene, T_W_C);
  for (float& z : keyframe->frame.depth_grid.z) z += z > 0 ? 0.02f : 0.0f;
  rig.mapper.addKeyframe(keyframe);
  MapUpdate update = updateFor(*keyframe, T_W_C);
  update.keyframes[0].camera_correction.offset = -0.02;
  const PlaneUpdate result = rig.mapper.applyMapUpdate(update);
  EXPECT_TRUE(rig.find(truth, 0.002));
  expectCorrectedObservations(result, T_W_C, update.keyframes[0].camera_correction);
}

TEST(Mapper, IntrinsicsThatWereWrongAreCorrectedInAllKeyframes) {
  // Focal lengths 2 % too long, the principal point 8 px off; the back end reports it with the sixth keyframe.
  Rig rig;
  const BearingCorrection bearing{{0.02, 0.02, 0.015, -0.01}};
  rig.camera.camera = testing::cameraThatMeans(*rig.camera.camera, bearing);
  const Scene scene = room();
  const Plane truth({-1, 0, 0}, 3);
  MapUpdate all;
  all.global = true;
  for (int i = 0; i < 6; ++i) {
    const SE3 T_W_C = lookAt({-1 + 0.2 * i, 0, 1.4}, {3, -1.5 + 0.1 * i, 1.0});
    const std::shared_ptr<Keyframe> keyframe = rig.camera.keyframe(scene, T_W_C);
    rig.place(keyframe, T_W_C);
    all.keyframes.push_back(updateFor(*keyframe, T_W_C).keyframes[0]);
    all.keyframes.back().camera_correction.bearing = bearing;
  }
  EXPECT_FALSE(rig.find(truth, 0.004));
  rig.mapper.applyMapUpdate(all);
  EXPECT_TRUE(rig.find(truth, 0.003));
  // A keyframe that carries the correction is used with it at once.
  const SE3 T_W_C = lookAt({0.3, 0.1, 1.4}, {3, -1.2, 1.1});
  const std::shared_ptr<Keyframe> keyframe = rig.camera.keyframe(scene, T_W_C);
  keyframe->frame.camera_correction.bearing = bearing;
  rig.mapper.addKeyframe(keyframe);
  MapUpdate update = updateFor(*keyframe, T_W_C);
  update.keyframes[0].camera_correction.bearing = bearing;
  const PlaneUpdate result = rig.mapper.applyMapUpdate(update);
  expectCorrectedObservations(result, T_W_C, update.keyframes[0].camera_correction);
}

void expectCarriedAlong(double yaw, bool optimised) {
  SCOPED_TRACE(::testing::Message() << "turned by " << yaw << (optimised ? ", optimised" : ""));
  Rig rig;
  const Scene scene = room();
  for (int i = 0; i < 6; ++i) rig.look(scene, {-1 + 0.4 * i, 0, 1.4}, {3, -1 + 0.4 * i, 1.0});
  const std::size_t count = rig.mapper.planes().size();
  const PlaneEstimate wall = *rig.find(Plane({-1, 0, 0}, 3));
  const SE3 move(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {2, -1, 0.2});
  MapUpdate update;
  update.global = true;
  for (const auto& [id, T] : rig.poses) {
    KeyframeEstimate k;
    k.id = id;
    k.state.T_W_I = move * T;
    update.keyframes.push_back(k);
  }
  if (optimised) update.planes.emplace_back(wall.id, transformPlane(move, wall.plane));
  rig.mapper.applyMapUpdate(update);
  EXPECT_EQ(count, rig.mapper.planes().size());
  const PlaneEstimate* moved = rig.find(transformPlane(move, wall.plane), 0.001);
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

// Rotations beyond a right angle keep the normal on the side that was seen.
TEST(Mapper, CorrectionsCarryPlanesAndAreaAlong) {
  for (const bool optimised : {false, true})
    for (const double yaw : {0.1, 0.5, M_PI / 2, 2.0, M_PI}) expectCarriedAlong(yaw, optimised);
}

// The keyframe before it did not see the wall yet.
TEST(Mapper, AreaOfAKeyframeThatGoesMovesWithTheUpdateThatItGoesWith) {
  Rig rig;
  Scene scene;
  scene.add({3, -2.5, 0}, {0, 5, 0}, {0, 0, 2.6});
  scene.add({-3, -2.5, 0}, {0, 5, 0}, {0, 0, 2.6});
  rig.look(scene, {0, 0, 1.4}, {-3, 0, 1.3});
  rig.look(scene, {0.2, -0.5, 1.4}, {3, -0.5, 1.3});
  rig.look(scene, {0.2, 0.5, 1.4}, {3, 0.8, 1.3});
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 3));
  ASSERT_TRUE(wall);
  const double area = wall->area;
  double low = 1e9;
  for (const auto& p : wall->polygons)
    for (const auto& q : p.outer) low = std::min(low, q.y());
  const SE3 move(Eigen::Quaterniond::Identity(), {0, 2, 0});
  MapUpdate update;
  update.global = true;
  update.removed_keyframes.push_back(2);
  for (const KeyframeId id : {KeyframeId(1), KeyframeId(3)}) {
    update.keyframes.emplace_back();
    update.keyframes.back().id = id;
    update.keyframes.back().state.T_W_I = move * rig.poses.at(id);
  }
  rig.mapper.applyMapUpdate(update);
  wall = rig.find(Plane({-1, 0, 0}, 3));
  ASSERT_TRUE(wall);
  EXPECT_NEAR(area, wall->area, 0.1 * area);
  double moved_low = 1e9;
  for (const auto& p : wall->polygons)
    for (const auto& q : p.outer) moved_low = std::min(moved_low, q.y());
  EXPECT_NEAR(low + 2, moved_low, 0.1);
}

// The first keyframe is tilted against its final pose; the floor far ahead is seen at too flat an angle for samples.
TEST(Mapper, APlaneThatNoObservationHoldsMovesWithTheKeyframeThatShowsIt) {
  PlaneMapperOptions options;
  options.observation.min_points = 1000;
  Rig rig(0, options);
  Scene scene;
  scene.add({2.5, -1, 0}, {2, 0, 0}, {0, 2, 0});
  const SE3 truth = lookAt({0, 0, 1.5}, {3.5, 0, 0});
  const SE3 leaning(expSO3({0, 0.02, 0}) * truth.rotation(), truth.t());
  const auto keyframe = rig.camera.keyframe(scene, truth);
  const PlaneUpdate before = rig.place(keyframe, leaning);
  ASSERT_EQ(1u, before.planes.size());
  EXPECT_TRUE(before.observations.empty());
  EXPECT_GT(before.planes[0].plane.d, 0.05);
  const PlaneUpdate after = rig.mapper.applyMapUpdate(updateFor(*keyframe, truth));
  ASSERT_EQ(1u, after.planes.size());
  EXPECT_NEAR(0, after.planes[0].plane.d, 0.01);
  EXPECT_NEAR(before.planes[0].area, after.planes[0].area, 0.05 * before.planes[0].area);
}

// These few samples of a strip do not determine its normal, so they are withheld from the back end: the plane in its
// updates is the one it was given before.
TEST(Mapper, APlaneWhoseObservationsAreWithheldIsNotTheBackEnds) {
  DepthNoise noise = testing::quietNoise();
  noise.bias_floor = 0.08;  // so that two views are too few
  Rig rig(noise);
  Scene scene;
  scene.add({3, -0.25, 0}, {0, 0.5, 0}, {0, 0, 2.6});
  const auto keyframe = rig.camera.keyframe(scene, lookAt({0, 0, 1.3}, {3, 0, 1.3}));
  rig.place(keyframe, lookAt({0, 0, 1.3}, {3, 0, 1.3}));
  const PlaneUpdate before = rig.look(scene, {0.05, 0, 1.3}, {3, 0, 1.3});
  ASSERT_EQ(1u, before.planes.size());
  ASSERT_TRUE(before.observations.empty());
  Plane stale = before.planes[0].plane;
  stale.d += 0.1;
  MapUpdate update;
  update.planes.emplace_back(before.planes[0].id, stale);
  const PlaneUpdate after = rig.mapper.applyMapUpdate(update);
  ASSERT_EQ(1u, after.planes.size());
  EXPECT_NEAR(before.planes[0].plane.d, after.planes[0].plane.d, 1e-6);
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

/// Global updates name all keyframes of the map.
MapUpdate everything(const std::map<KeyframeId, SE3>& poses) {
  MapUpdate update;
  update.global = true;
  for (const auto& [id, T] : poses) {
    update.keyframes.emplace_back();
    update.keyframes.back().id = id;
    update.keyframes.back().state.T_W_I = T;
    update.newest_keyframe = id;
  }
  return update;
}

TEST(MapperCorrections, AGlobalUpdateHealsWhatALostOneHadRemoved) {
  const Scene scene = room();
  Rig told, missed;
  for (Rig* rig : {&told, &missed}) {
    for (int i = 0; i < 6; ++i) rig->look(scene, {-1 + 0.3 * i, 0, 1.4}, {3, -1.2 + 0.4 * i, 1.0});
  }
  MapUpdate removal;
  removal.removed_keyframes = {6};
  told.mapper.applyMapUpdate(removal);  // the other mapper does not receive this update
  for (Rig* rig : {&told, &missed}) {
    rig->poses.erase(6);
    rig->mapper.applyMapUpdate(everything(rig->poses));
  }
  ASSERT_EQ(told.mapper.planes().size(), missed.mapper.planes().size());
  for (std::size_t i = 0; i < told.mapper.planes().size(); ++i) {
    EXPECT_EQ(told.mapper.planes()[i].id, missed.mapper.planes()[i].id);
    EXPECT_NEAR(told.mapper.planes()[i].area, missed.mapper.planes()[i].area, 1e-9);
  }
}

TEST(MapperCorrections, KeyframesThatTheBackEndNeverTookAreNotKept) {
  const Scene scene = room();
  Rig rig;
  for (int i = 0; i < 6; ++i) {
    const SE3 T = lookAt({0, 0.2 * i, 1.4}, {3, 0.2, 1.0});
    const auto keyframe = rig.camera.keyframe(scene, T);
    if (i % 2 == 0) {
      rig.place(keyframe, T);
    } else {
      rig.mapper.addKeyframe(keyframe);
    }
  }
  EXPECT_EQ(3u, rig.mapper.counters().keyframes_waiting);
  rig.mapper.applyMapUpdate(everything(rig.poses));
  EXPECT_EQ(1u, rig.mapper.counters().keyframes_waiting);  // the newest one may still be placed
  rig.mapper.clear();
  EXPECT_EQ(0u, rig.mapper.counters().keyframes_waiting);
}

TEST(MapperCorrections, AKeyframeOnItsWayIsNoneOfAMapThatIsLoadedMeanwhile) {
  const Scene scene = room();
  Rig stored, rig;
  for (int i = 0; i < 6; ++i) stored.look(scene, {-1 + 0.3 * i, 0, 1.4}, {3, -1.2 + 0.4 * i, 1.0});
  rig.mapper.restore(testing::storedPlanes(stored.mapper.planes()), 6);
  rig.mapper.addKeyframe(rig.camera.keyframe(scene, lookAt({0, 0, 1.4}, {-3, 1, 1.0})));  // number 1 of its session
  const PlaneUpdate update = rig.mapper.applyMapUpdate(everything(stored.poses));
  EXPECT_TRUE(update.observations.empty());
  EXPECT_EQ(stored.mapper.planes().size(), rig.mapper.planes().size());
}

// A cupboard that is moved back or forward: its two positions are merged, and disagree.
TEST(Mapper, AFrontThatWasMovedIsWhereItIsNow) {
  for (const double way : {0.06, 0.09, -0.06}) {
    const auto with_front_at = [](double y) {
      Scene scene = room();
      scene.add({0.3, y, 0}, {1.3, 0, 0}, {0, 0, 1.8});
      scene.add({0.3, y - 0.4, 0}, {0, 0.4, 0}, {0, 0, 1.8});
      scene.add({1.6, y - 0.4, 0}, {0, 0.4, 0}, {0, 0, 1.8});
      return scene;
    };
    const Scene before = with_front_at(-1.8), after = with_front_at(-1.8 - way);
    Rig rig;
    const auto look = [&](const Scene& scene, int keyframes) {
      for (int k = 0; k < keyframes; ++k) {
        const double q = 0.4 * k;
        rig.look(scene, {0.5 + 0.8 * std::sin(q), 1.0 + 0.4 * std::cos(0.7 * q), 1.3},
                 {0.9 + 0.5 * std::sin(1.3 * q), -2, 1});
      }
    };
    look(before, 15);
    ASSERT_TRUE(rig.find(Plane({0, 1, 0}, 1.8), 0.005)) << way;
    look(after, 25);
    EXPECT_TRUE(rig.find(Plane({0, 1, 0}, 1.8 + way), 0.01)) << way;
    EXPECT_FALSE(rig.find(Plane({0, 1, 0}, 1.8), 0.01)) << way;
  }
}

}  // namespace
}  // namespace vip_slam
