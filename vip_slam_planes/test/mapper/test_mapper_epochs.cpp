// SPDX-License-Identifier: BSD-3-Clause
// Effect of keyframes of a restarted odometry on planes, before and after their pose in the map is known.
#include <algorithm>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "rig.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Rig;
using testing::room;
using testing::updateFor;

std::shared_ptr<Keyframe> taken(Rig* rig, const SE3& T_W_C, std::uint32_t epoch, KeyframeId first_id = 1) {
  auto keyframe = rig->camera.keyframe(room(), T_W_C);
  keyframe->id += first_id - 1;
  keyframe->frame.keyframe = keyframe->id;
  keyframe->frame.epoch = epoch;
  return keyframe;
}

SE3 view(int i) { return lookAt({-1 + 0.3 * i, 0.1 * i, 1.4}, {3, -0.8 + 0.4 * i, 1.0}); }

/// Guessed pose in `map` of a back end that continues where the map ends: 1.5 m off, so the wall ahead seems further
/// away.
SE3 guess(const SE3& truth) { return SE3(truth.rotation(), truth.t() + Eigen::Vector3d(1.5, 0, 0)); }

std::vector<EpochPart> together(std::uint32_t a, std::uint32_t b) { return {{a, a}, {b, a}}; }
std::vector<EpochPart> apart(std::uint32_t a, std::uint32_t b) { return {{a, a}, {b, b}}; }

/// The update in which the back end places a keyframe and closes a loop with it: it moves all keyframes to their true
/// poses, and joins the keyframe's epoch to `epoch`.
MapUpdate closing(const Keyframe& query, std::uint32_t epoch, const std::map<KeyframeId, SE3>& truth) {
  MapUpdate update = updateFor(query, truth.at(query.id));
  update.global = true;
  update.keyframes.clear();
  for (const auto& [id, T] : truth) {
    update.keyframes.emplace_back();
    update.keyframes.back().id = id;
    update.keyframes.back().state.T_W_I = T;
  }
  update.parts = together(epoch, query.frame.epoch);
  return update;
}

std::set<PlaneId> idsOf(const Rig& rig) {
  std::set<PlaneId> ids;
  for (const PlaneEstimate& p : rig.mapper.planes()) ids.insert(p.id);
  return ids;
}

void expectSame(const std::vector<PlaneEstimate>& a, const std::vector<PlaneEstimate>& b) {
  ASSERT_LE(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].id, b[i].id);
    EXPECT_EQ(a[i].keyframes, b[i].keyframes);
    EXPECT_EQ(a[i].area, b[i].area);
    EXPECT_EQ(a[i].plane.n, b[i].plane.n);
    EXPECT_EQ(a[i].plane.d, b[i].plane.d);
    ASSERT_EQ(a[i].polygons.size(), b[i].polygons.size());
    for (std::size_t k = 0; k < a[i].polygons.size(); ++k) EXPECT_EQ(a[i].polygons[k].outer, b[i].polygons[k].outer);
  }
}

TEST(MapperEpochs, AGuessedPlaceSaysNothingAboutPlanesOfAnotherEpoch) {
  Rig rig;
  for (int i = 0; i < 6; ++i) rig.place(taken(&rig, view(i), 0), view(i));
  const std::vector<PlaneEstimate> before = rig.mapper.planes();
  const std::set<PlaneId> old = idsOf(rig);
  ASSERT_GE(before.size(), 3u);
  ASSERT_TRUE(rig.find(Plane({-1, 0, 0}, 3)));
  for (int i = 0; i < 6; ++i) {
    const auto keyframe = taken(&rig, view(i), 1);
    rig.mapper.addKeyframe(keyframe);
    MapUpdate update = updateFor(*keyframe, guess(view(i)));
    update.parts = apart(0, 1);
    const PlaneUpdate result = rig.mapper.applyMapUpdate(update);
    EXPECT_TRUE(result.removed.empty());
    EXPECT_TRUE(result.merges.empty());
    for (const PlaneObservation& o : result.observations) EXPECT_EQ(0u, old.count(o.plane)) << o.keyframe;
  }
  expectSame(before, rig.mapper.planes());
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 3)));
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 4.5)));
  EXPECT_EQ(2 * before.size(), rig.mapper.planes().size());
}

TEST(MapperEpochs, ALoopBetweenEpochsMakesOnePlaneOfTwo) {
  Rig rig;
  std::map<KeyframeId, SE3> truth;
  for (int i = 0; i < 12; ++i) {
    const SE3 T = view(i % 6);
    const auto keyframe = taken(&rig, T, i / 6);
    truth[keyframe->id] = T;
    rig.place(keyframe, i < 6 ? T : guess(T));
  }
  std::set<PlaneId> old, fresh;
  for (const PlaneId id : idsOf(rig)) (old.size() < rig.mapper.planes().size() / 2 ? old : fresh).insert(id);
  ASSERT_GE(old.size(), 3u);
  ASSERT_EQ(old.size(), fresh.size());

  const auto query = taken(&rig, view(3), 1);
  truth[query->id] = view(3);
  rig.mapper.addKeyframe(query);
  const PlaneUpdate result = rig.mapper.applyMapUpdate(closing(*query, 0, truth));
  EXPECT_EQ(old, idsOf(rig));
  EXPECT_TRUE(result.removed.empty());
  std::set<PlaneId> from, into;
  for (const PlaneMerge& merge : result.merges) from.insert(merge.from), into.insert(merge.into);
  EXPECT_EQ(fresh, from);
  EXPECT_EQ(old, into);
  EXPECT_TRUE(rig.find(Plane({-1, 0, 0}, 3), 0.004));

  // From now on its keyframes see the planes of both.
  const PlaneUpdate next = rig.place(taken(&rig, view(4), 1), view(4));
  EXPECT_EQ(old, idsOf(rig));
  EXPECT_TRUE(std::any_of(next.observations.begin(), next.observations.end(),
                          [&](const PlaneObservation& o) { return o.keyframe == query->id + 1; }));
}

// After seconds in the dark the odometry goes on in one epoch, metres off: a wall that comes to lie on another one's
// place is not that one.
TEST(MapperEpochs, WhatLiesBehindAnUnsureMotionIsNotToldByItsPlace) {
  for (const double sigma : {0.003, 0.7}) {
    Rig rig;
    std::map<KeyframeId, SE3> truth;
    const auto look = [&](int i, bool first) {
      const auto keyframe = taken(&rig, view(i), 0);
      keyframe->motion.covariance.diagonal().setConstant(1e-6);
      if (first) keyframe->motion.covariance.diagonal().tail<3>().setConstant(sigma * sigma);
      truth[keyframe->id] = view(i);
      return keyframe;
    };
    for (int i = 0; i < 6; ++i) rig.place(look(i, false), view(i));
    const std::vector<PlaneEstimate> before = rig.mapper.planes();
    const std::set<PlaneId> old = idsOf(rig);
    std::size_t known_again = 0;
    for (int i = 0; i < 6; ++i) {
      const PlaneUpdate result = rig.place(look(i, i == 0), guess(view(i)));
      for (const PlaneObservation& o : result.observations) known_again += old.count(o.plane);
    }
    if (sigma < 0.01) {
      EXPECT_GT(known_again, 0u) << "floor and ceiling lie where they did";
      continue;
    }
    EXPECT_EQ(known_again, 0u);
    expectSame(before, rig.mapper.planes());
    EXPECT_EQ(2 * before.size(), rig.mapper.planes().size());

    const auto query = look(3, false);
    rig.mapper.addKeyframe(query);
    MapUpdate update = closing(*query, 0, truth);
    update.loops.emplace_back();
    update.loops.back().query = query->id;
    update.loops.back().match = 2;
    update.loops.back().accepted = true;
    rig.mapper.applyMapUpdate(update);
    EXPECT_EQ(old, idsOf(rig)) << "the loop tells that they are the same";
  }
}

// A motion that is unsure along one axis leaves unsure only where the walls across that axis are.
TEST(MapperEpochs, AMotionIsUnsureOnlyForPlanesAcrossIt) {
  Rig rig;
  const auto look = [&](int i, bool first) {
    const SE3 T_W_C = view(i);
    const auto keyframe = taken(&rig, T_W_C, 0);
    keyframe->motion.T_a_b = SE3(expSO3({0, 0.3, 0}), {0.1, 0, 0});
    Eigen::Vector3d variance(1e-6, 1e-6, first ? 0.25 : 1e-6);  // of the displacement in the map: up and down
    const Eigen::Matrix3d R_a_W = keyframe->motion.T_a_b.R() * T_W_C.R().transpose();
    keyframe->motion.covariance.setIdentity();
    keyframe->motion.covariance *= 1e-6;
    keyframe->motion.covariance.bottomRightCorner<3, 3>() = R_a_W * variance.asDiagonal() * R_a_W.transpose();
    return rig.place(keyframe, T_W_C);
  };
  for (int i = 0; i < 6; ++i) look(i, false);
  const std::set<PlaneId> old = idsOf(rig);
  for (int i = 0; i < 6; ++i) look(i, i == 0);
  int walls = 0, level = 0;
  for (const PlaneEstimate& plane : rig.mapper.planes()) {
    if (old.count(plane.id)) continue;
    ++(plane.kind == PlaneKind::kHorizontal ? level : walls);
  }
  EXPECT_EQ(0, walls) << "they lie where they did";
  EXPECT_GT(level, 0) << "floor or ceiling may be another one";
}

TEST(MapperEpochs, AnEpochBelongsToALoadedMapOnceItIsRecognised) {
  constexpr KeyframeId kFirst = 100;  // the loaded map has the ids before
  constexpr std::uint32_t kLoaded = 0x80000000u;
  Rig first, rig;
  for (int i = 0; i < 6; ++i) first.place(taken(&first, view(i), 0), view(i));
  rig.mapper.restore(testing::storedPlanes(first.mapper.planes(), kLoaded), kFirst - 1);
  const std::set<PlaneId> loaded = idsOf(rig);
  // Localisation places a keyframe that does not enter the map; mapping continues later, after the odometry has
  // drifted.
  const auto passing = taken(&rig, view(0), 4, kFirst);
  MapUpdate update = updateFor(*passing, view(0));
  update.keyframes.clear();
  update.removed_keyframes = {passing->id};
  rig.mapper.addKeyframe(passing);
  rig.mapper.applyMapUpdate(update);
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(rig.place(taken(&rig, view(i), 4, kFirst), guess(view(i))).removed.empty());
  }
  EXPECT_EQ(2 * loaded.size(), rig.mapper.planes().size());

  rig.mapper.restore(testing::storedPlanes(first.mapper.planes(), kLoaded), kFirst - 1);
  const auto found = taken(&rig, view(0), 5, kFirst);
  update = updateFor(*found, view(0));
  update.parts = together(5, kLoaded);
  rig.mapper.addKeyframe(found);
  rig.mapper.applyMapUpdate(update);
  for (int i = 1; i < 3; ++i) rig.place(taken(&rig, view(i), 5, kFirst), view(i));
  EXPECT_EQ(loaded, idsOf(rig));

  std::map<KeyframeId, SE3> truth = rig.poses;
  for (int i = 0; i < 6; ++i) {
    const auto keyframe = taken(&rig, view(i), 6, kFirst);
    truth[keyframe->id] = view(i);
    EXPECT_TRUE(rig.place(keyframe, guess(view(i))).removed.empty());
  }
  EXPECT_EQ(2 * loaded.size(), rig.mapper.planes().size());

  const auto query = taken(&rig, view(3), 6, kFirst);
  truth[query->id] = view(3);
  rig.mapper.addKeyframe(query);
  rig.mapper.applyMapUpdate(closing(*query, kLoaded, truth));
  EXPECT_EQ(loaded, idsOf(rig));
}

TEST(MapperEpochs, AreaOfARemovedKeyframeStaysWithItsEpoch) {
  Rig rig;
  for (int i = 0; i < 6; ++i) rig.place(taken(&rig, view(i), 0), view(i));
  const std::vector<PlaneEstimate> before = rig.mapper.planes();
  MapUpdate update;
  for (int i = 0; i < 3; ++i) {
    const auto keyframe = taken(&rig, view(i), 1);
    rig.place(keyframe, guess(view(i)));
    if (i == 0) update.removed_keyframes.push_back(keyframe->id);
  }
  const double area = rig.find(Plane({-1, 0, 0}, 4.5))->area;
  rig.mapper.applyMapUpdate(update);
  // The old epoch moves; what the new one covered stays.
  const Eigen::Vector3d up(0, 0, 0.7);
  MapUpdate moved;
  for (KeyframeId id = 1; id <= 6; ++id) {
    moved.keyframes.push_back(updateFor(*taken(&rig, view(0), 0), {}).keyframes.front());
    moved.keyframes.back().id = id;
    moved.keyframes.back().state.T_W_I = SE3(rig.poses.at(id).rotation(), rig.poses.at(id).t() + up);
  }
  rig.mapper.applyMapUpdate(moved);
  const PlaneEstimate* wall = rig.find(Plane({-1, 0, 0}, 4.5));
  ASSERT_TRUE(wall);
  EXPECT_NEAR(area, wall->area, 1e-9);
  for (const PlanePolygon& p : wall->polygons)
    for (const Eigen::Vector3d& q : p.outer) EXPECT_LT(q.z(), 2.75);
}

// The update with the loop is lost; the one that places the next keyframe reports the tie as well.
TEST(MapperEpochs, ATieInALostUpdateComesWithTheNext) {
  Rig rig;
  std::map<KeyframeId, SE3> truth;
  for (int i = 0; i < 12; ++i) {
    const SE3 T = view(i % 6);
    const auto keyframe = taken(&rig, T, i / 6);
    truth[keyframe->id] = T;
    rig.place(keyframe, i < 6 ? T : guess(T));
  }
  const std::size_t twice = rig.mapper.planes().size();
  const auto query = taken(&rig, view(3), 1), next = taken(&rig, view(4), 1);
  rig.mapper.addKeyframe(query);
  rig.mapper.addKeyframe(next);
  truth[query->id] = view(3);
  truth[next->id] = view(4);
  MapUpdate update = updateFor(*next, view(4));
  update.keyframes = closing(*query, 0, truth).keyframes;
  update.global = true;
  update.parts = together(0, 1);
  rig.mapper.applyMapUpdate(update);
  EXPECT_EQ(twice, 2 * rig.mapper.planes().size());
}

// A stored map of two parts, of which the second is 1.5 m off, at the back end's guess.
TEST(MapperEpochs, AStoredFragmentSaysNothingUntilItIsTiedAndThenComesAlong) {
  constexpr KeyframeId kFirst = 100, kHost = 1, kOther = 50;
  constexpr std::uint32_t kMap = 0x80000000u, kFragment = 0x80000001u;
  Rig map, fragment, rig;
  for (int i = 0; i < 6; ++i) {
    map.place(taken(&map, view(i), 0), view(i));
    fragment.place(taken(&fragment, view(i), 0), guess(view(i)));
  }
  std::vector<StoredPlane> planes = testing::storedPlanes(map.mapper.planes(), kMap, kHost, view(0));
  const std::size_t once = planes.size();
  for (StoredPlane plane : testing::storedPlanes(fragment.mapper.planes(), kFragment, kOther, guess(view(0)))) {
    plane.estimate.id += 1000;
    planes.push_back(plane);
  }
  rig.mapper.restore(planes, kFirst - 1);
  rig.mapper.applyMapUpdate({});  // polygons are recomputed
  const Plane far_wall({-1, 0, 0}, 4.5);
  ASSERT_TRUE(rig.find(far_wall));
  const double area = rig.find(far_wall)->area;

  // Views of the map through the apparent position of the fragment's walls.
  std::map<KeyframeId, SE3> truth = {{kHost, view(0)}, {kOther, view(0)}};
  const auto place = [&](int i, const std::vector<EpochPart>& parts) {
    const auto keyframe = taken(&rig, view(i % 6), 0, kFirst);
    truth[keyframe->id] = view(i % 6);
    MapUpdate base;
    base.parts = parts;
    return rig.place(keyframe, view(i % 6), base);
  };
  for (int i = 0; i < 12; ++i) {
    const PlaneUpdate update = place(i, {{0, kMap}, {kMap, kMap}, {kFragment, kFragment}});
    EXPECT_TRUE(update.removed.empty());
    EXPECT_TRUE(update.merges.empty());
    for (const PlaneObservation& o : update.observations) EXPECT_LT(o.plane, 1000u);
  }
  EXPECT_EQ(2 * once, rig.mapper.planes().size());
  ASSERT_TRUE(rig.find(far_wall));
  EXPECT_EQ(area, rig.find(far_wall)->area);

  // A loop ties the fragment; the back end reports the wall's new position and the pose of its host.
  const auto query = taken(&rig, view(2), 0, kFirst);
  truth[query->id] = view(2);
  rig.mapper.addKeyframe(query);
  MapUpdate loop = closing(*query, kMap, truth);
  loop.parts.push_back({kFragment, kMap});
  for (const StoredPlane& plane : planes) {
    if (plane.host.epoch != kFragment) continue;
    const Plane& lying = plane.estimate.plane;
    loop.planes.emplace_back(plane.estimate.id, Plane(lying.n, lying.d + lying.n.x() * 1.5));
  }
  const PlaneUpdate update = rig.mapper.applyMapUpdate(loop);
  EXPECT_EQ(once, update.merges.size());
  EXPECT_EQ(once, rig.mapper.planes().size());
  // Polygons drawn 1.5 m off have moved along: no floor beyond the wall.
  for (const PlaneEstimate& plane : rig.mapper.planes())
    for (const PlanePolygon& p : plane.polygons)
      for (const Eigen::Vector3d& q : p.outer) EXPECT_LT(q.x(), 3.25) << plane.id;
}

TEST(MapperEpochs, OneEpochIsAsItWasWhateverItsNumber) {
  Rig zero, seven;
  for (int i = 0; i < 8; ++i) {
    for (Rig* rig : {&zero, &seven}) {
      const auto keyframe = taken(rig, view(i), rig == &zero ? 0 : 7);
      rig->mapper.addKeyframe(keyframe);
      MapUpdate update = updateFor(*keyframe, view(i));
      if (rig == &seven) update.parts = {{7, 7}};
      rig->mapper.applyMapUpdate(update);
    }
    ASSERT_EQ(zero.mapper.planes().size(), seven.mapper.planes().size());
    expectSame(zero.mapper.planes(), seven.mapper.planes());
  }
  EXPECT_GE(zero.mapper.planes().size(), 3u);
}

}  // namespace
}  // namespace vip_slam
