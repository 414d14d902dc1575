// SPDX-License-Identifier: BSD-3-Clause
// Association of map points with planes.
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "scene.h"
#include "vip_slam_planes/association/consistency_test.h"
#include "vip_slam_planes/association/point_association.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {
namespace {

using testing::lookAt;
using testing::Scene;
using testing::SceneCamera;

std::vector<PointSighting> sightings(const Eigen::Vector3d& p, double baseline, int count, double depth_sigma,
                                     unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss;
  std::vector<PointSighting> result;
  for (int i = 0; i < count; ++i) {
    const SE3 T_C_W = lookAt({0, baseline * (double(i) / (count - 1) - 0.5), 1.2}, {3, 0, 1.2}).inverse();
    const Eigen::Vector3d q = T_C_W * p;
    const Eigen::Vector2d noise = Eigen::Vector2d(gauss(random), gauss(random)) * 0.5 / 525;
    result.push_back(
        {T_C_W, q.head<2>() / q.z() + noise, depth_sigma > 0 ? q.z() + depth_sigma * gauss(random) : 0.0, depth_sigma});
  }
  return result;
}

TEST(Consistency, OnAndOffThePlane) {
  const Plane wall({-1, 0, 0}, 3);
  PointAssociationOptions options;
  int on = 0, off = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Eigen::Vector3d p(3, -0.8 + 0.03 * seed, 0.7 + 0.02 * seed), q = p - Eigen::Vector3d(0.08, 0, 0);
    const Eigen::Vector3d start = p + Eigen::Vector3d(0.02, 0, 0);
    on += testConsistency(sightings(p, 1.5, 5, 0.01, seed), wall, start, 525, options).consistent;
    off += testConsistency(sightings(q, 1.5, 5, 0.01, seed), wall, q, 525, options).consistent;
  }
  EXPECT_GE(on, 49);
  EXPECT_EQ(0, off);
}

TEST(Consistency, DepthDecidesWithoutParallax) {
  const Plane wall({-1, 0, 0}, 3);
  const Eigen::Vector3d q(2.9, 0.1, 1.3);
  EXPECT_FALSE(testConsistency(sightings(q, 0.02, 5, 0.008, 1), wall, q, 525, {}).consistent);
}

TEST(Consistency, NeedsSightingsInFront) {
  const Plane wall({-1, 0, 0}, 3);
  EXPECT_FALSE(testConsistency({}, wall, {3, 0, 1}, 525, {}).solved);
  EXPECT_FALSE(testConsistency(sightings({-3, 0, 1}, 1, 4, 0, 1), wall, {-3, 0, 1}, 525, {}).solved);
}

// A point 5 cm before the wall. At first all views are alike, so that it passes for a point on the wall; then the
// camera moves sideways. It is tested after twice as many views as before, and then with each view until it has failed
// often enough.
TEST(Points, OneThatFailsIsGivenUpSoon) {
  constexpr double kFocal = 525;
  PointAssociationOptions options;
  PointAssociation points(options, kFocal, 0.002);
  const Plane wall({-1, 0, 0}, 3);
  const auto find = [&wall](PlaneId id) { return id == 7 ? &wall : nullptr; };
  const Eigen::Vector3d p(2.95, 0.1, 1.2);
  SurfaceLabels labels;
  labels.stride = 100, labels.cols = 7, labels.rows = 5;
  labels.label.assign(35, 0);
  CameraPoses poses;
  int associated_at = 0, dropped_at = 0;
  for (int k = 1; k <= 20; ++k) {
    Keyframe keyframe;
    keyframe.id = static_cast<KeyframeId>(k);
    const double side = k <= 6 ? 0.0 : 0.15 * (k - 6);
    poses[keyframe.id] = lookAt({0, side, 1.2}, {3, side, 1.2});
    const Eigen::Vector3d q = poses[keyframe.id].inverse() * p;
    Feature f;
    f.id = 1;
    f.xy = (q.head<2>() / q.z()).cast<float>();
    f.pixel = (q.head<2>() / q.z() * kFocal + Eigen::Vector2d(320, 240)).cast<float>();
    if (k == 1) f.depth = static_cast<float>(q.z()), f.depth_sigma = 0.1f;
    keyframe.frame.features.push_back(f);
    MapUpdate placed;
    placed.landmarks.push_back({1, p, 0});
    points.addSightings(keyframe);
    points.applyMapUpdate(placed);
    points.process(keyframe, labels, {7}, {1}, poses, find);
    if (points.planeOf(1) == 7 && associated_at == 0) associated_at = k;
    if (points.planeOf(1) == 0 && associated_at != 0 && dropped_at == 0) dropped_at = k;
  }
  EXPECT_EQ(associated_at, options.min_keyframes);
  EXPECT_EQ(dropped_at, 2 * options.min_keyframes + options.max_failures - 1);
}

struct World {
  Scene scene;
  std::vector<Eigen::Vector3d> points;
  std::vector<int> truth;  ///< 1: on the wall, 2: floor, 0: neither
};

World world() {
  World w;
  w.scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  w.scene.add({-3, -3, 0}, {6, 0, 0}, {0, 6, 0});
  w.scene.add({2.93, -1, 1.0}, {0, 0.5, 0}, {0, 0, 0.6});  // 7 cm off the wall
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 150; ++i) {
    w.points.emplace_back(3, -2 + 4 * u(random), 0.2 + 2 * u(random));
    const bool hidden = w.points.back().y() > -1.1 && w.points.back().y() < -0.4 && w.points.back().z() > 0.9 &&
                        w.points.back().z() < 1.7;
    w.truth.push_back(hidden ? -1 : 1);
    w.points.emplace_back(0.5 + 2.3 * u(random), -2 + 4 * u(random), 0);
    w.truth.push_back(2);
    w.points.emplace_back(2.93, -0.99 + 0.48 * u(random), 1.01 + 0.58 * u(random));
    w.truth.push_back(0);
  }
  return w;
}

struct Associations {
  std::map<LandmarkId, PlaneId> plane;  ///< of the associated ones
  std::map<LandmarkId, int> seen;       ///< keyframes
};

/// Some keyframes; the landmarks are where the points are.
Associations associate(const World& w, SceneCamera* camera, PlaneMapper* mapper, int first = 0, int keyframes = 8) {
  Associations result;
  for (int i = first; i < first + keyframes; ++i) {
    const SE3 T_W_C = lookAt({-0.8, -1.2 + 0.35 * i, 1.4}, {3, -0.5 + 0.1 * i, 0.9});
    const auto keyframe = camera->keyframe(w.scene, T_W_C, w.points, 0.5);
    for (const Feature& f : keyframe->frame.features) ++result.seen[f.id];
    mapper->addKeyframe(keyframe);
    MapUpdate update = testing::updateFor(*keyframe, T_W_C);
    for (std::size_t k = 0; k < w.points.size(); ++k) {
      LandmarkEstimate estimate;
      estimate.id = LandmarkId(k);
      estimate.p_W = w.points[k];
      update.landmarks.push_back(estimate);
    }
    const PlaneUpdate answer = mapper->applyMapUpdate(update);
    for (const auto& [id, plane] : answer.associated) result.plane[id] = plane;
    for (LandmarkId id : answer.dissociated) result.plane.erase(id);
  }
  return result;
}

TEST(Points, BesideACreaseEachFindsItsSide) {
  World w;
  w.scene.add({3, -3, 0}, {0, 6, 0}, {0, 0, 2.6});
  w.scene.add({-3, -3, 0}, {6, 0, 0}, {0, 6, 0});
  for (double y = -1.2; y < 1.2; y += 0.05) {
    w.points.emplace_back(3, y, 0.015);
    w.points.emplace_back(2.98, y + 0.02, 0);
  }
  SceneCamera camera(testing::quietNoise(), 1.0);
  PlaneMapper mapper({}, camera.camera, camera.noise);
  const Associations found = associate(w, &camera, &mapper);
  ASSERT_EQ(2u, mapper.planes().size());
  std::size_t wrong = 0;
  for (const auto& [id, plane] : found.plane) {
    for (const PlaneEstimate& p : mapper.planes()) {
      wrong += p.id == plane && std::abs(p.plane.signedDistance(w.points[id])) > 0.01;
    }
  }
  EXPECT_GE(found.plane.size(), w.points.size() * 9 / 10);
  EXPECT_LE(wrong, found.plane.size() / 20);
}

TEST(Points, PrecisionAndRecallAndMergedLandmarks) {
  const World w = world();
  SceneCamera camera(testing::quietNoise(), 1.0);
  PlaneMapper mapper({}, camera.camera, camera.noise);
  const Associations found_on = associate(w, &camera, &mapper);
  const std::map<LandmarkId, PlaneId>& associated = found_on.plane;
  PlaneId wall = 0, floor = 0;
  for (const PlaneEstimate& p : mapper.planes()) {
    if (p.kind == PlaneKind::kHorizontal) floor = p.id;
    if (p.kind == PlaneKind::kVertical && std::abs(p.plane.d - 3) < 0.01) wall = p.id;
  }
  ASSERT_TRUE(wall && floor);
  int correct = 0, wrong = 0, expected = 0;
  for (const auto& [id, plane] : associated) {
    const int truth = w.truth[id];
    if (truth < 0) continue;
    (truth == 1 && plane == wall) || (truth == 2 && plane == floor) || (truth == 0 && plane != wall && plane != floor)
        ? ++correct
        : ++wrong;
  }
  int found = 0;
  for (const auto& [id, count] : found_on.seen) {
    if (count < 5 || w.truth[id] < 1) continue;
    ++expected;
    found += associated.count(id) ? 1 : 0;
  }
  EXPECT_GT(expected, 150);
  EXPECT_LE(wrong, correct / 50);
  EXPECT_GE(found, expected * 8 / 10);

  // A merge of landmarks keeps the association; a plane that moves away loses its points.
  const LandmarkId first = associated.begin()->first;
  MapUpdate merge;
  merge.merged_landmarks.emplace_back(first, 100000);
  const PlaneUpdate renamed = mapper.applyMapUpdate(merge);
  ASSERT_EQ(1u, renamed.associated.size());
  EXPECT_EQ(100000, renamed.associated[0].first);
  EXPECT_EQ(associated.begin()->second, renamed.associated[0].second);
  MapUpdate away;
  away.global = true;
  away.planes.emplace_back(wall, Plane({-1, 0, 0}, 3.3));
  EXPECT_GT(mapper.applyMapUpdate(away).dissociated.size(), 20u);
}

// Three keyframes, one fewer than required, see the points with focal lengths 2 % too long; then the error is known.
TEST(Points, WhatWasSeenByWrongIntrinsicsCountsAsItIsMeant) {
  const World w = world();
  SceneCamera camera(testing::quietNoise(), 1.0);
  PlaneMapper mapper({}, camera.camera, camera.noise);
  const BearingCorrection bearing{{0.02, 0.02, 0.015, -0.01}};
  camera.camera = testing::cameraThatMeans(*camera.camera, bearing);
  std::map<LandmarkId, int> seen;
  std::set<LandmarkId> associated;
  MapUpdate placed;
  for (int i = 0; i < 7; ++i) {
    const SE3 T_W_C = lookAt({-0.8, -1.2 + 0.35 * i, 1.4}, {3, -0.5 + 0.1 * i, 0.9});
    const auto keyframe = camera.keyframe(w.scene, T_W_C, w.points, 0.5);
    for (Feature& f : keyframe->frame.features) {
      ++seen[f.id];
      if (i < 3) f.xy = (bearing.matrix().inverse().cast<float>() * f.xy.homogeneous()).head<2>();
    }
    if (i >= 3) keyframe->frame.camera_correction.bearing = bearing;
    mapper.addKeyframe(keyframe);
    placed.keyframes.push_back(testing::updateFor(*keyframe, T_W_C).keyframes[0]);
    MapUpdate update;
    update.global = i == 3;
    update.keyframes = placed.keyframes;
    if (!update.global) update.keyframes = {placed.keyframes.back()};
    for (KeyframeEstimate& k : update.keyframes)
      if (i >= 3) k.camera_correction.bearing = bearing;
    for (std::size_t k = 0; k < w.points.size(); ++k) {
      LandmarkEstimate estimate;
      estimate.id = LandmarkId(k);
      estimate.p_W = w.points[k];
      update.landmarks.push_back(estimate);
    }
    const PlaneUpdate answer = mapper.applyMapUpdate(update);
    for (const auto& [id, plane] : answer.associated) associated.insert(id);
    for (LandmarkId id : answer.dissociated) associated.erase(id);
  }
  int expected = 0, found = 0;
  for (const auto& [id, count] : seen) {
    if (count < 5 || w.truth[id] < 1) continue;
    ++expected;
    found += associated.count(id) ? 1 : 0;
  }
  EXPECT_GT(expected, 150);
  EXPECT_GE(found, expected * 8 / 10);
}

// A plane optimised by the back end may fit none of the keyframes that saw it: then it covers several surfaces and is
// removed from the map. This one is a single surface, and comes back with all its observations.
TEST(Points, LeaveAPlaneWhoseObservationsDisagreeAndComeBack) {
  const World w = world();
  SceneCamera camera(testing::quietNoise(), 1.0);
  PlaneMapper mapper({}, camera.camera, camera.noise);
  const Associations found = associate(w, &camera, &mapper, 0, 16);
  PlaneId wall = 0;
  for (const PlaneEstimate& p : mapper.planes())
    if (p.kind == PlaneKind::kVertical && std::abs(p.plane.d - 3) < 0.01) wall = p.id;
  ASSERT_TRUE(wall);
  const auto shown = [&] {
    return std::count_if(mapper.planes().begin(), mapper.planes().end(), [&](const auto& p) { return p.id == wall; });
  };
  std::size_t on_wall = 0;
  for (const auto& [id, plane] : found.plane) on_wall += plane == wall;
  ASSERT_GT(on_wall, 50u);
  MapUpdate update;
  update.planes.emplace_back(wall, Plane({-1, 0, 0}, 3.0));
  EXPECT_EQ(mapper.applyMapUpdate(update).dissociated.size(), 0u);
  EXPECT_EQ(1, shown());
  update.planes.back().second = Plane({-1, 0, 0}, 3.03);
  const PlaneUpdate away = mapper.applyMapUpdate(update);
  EXPECT_EQ(away.dissociated.size(), on_wall);
  EXPECT_EQ(away.removed, std::vector<PlaneId>{wall});
  EXPECT_EQ(0, shown());
  // The earlier observations are still valid: no new keyframe is needed.
  const PlaneUpdate again = mapper.applyMapUpdate(MapUpdate());
  EXPECT_EQ(1, shown());
  std::size_t back = 0, observed = 0;
  for (const auto& [id, plane] : again.associated) back += plane == wall;
  for (const PlaneObservation& o : again.observations) observed += o.plane == wall;
  EXPECT_GT(back, on_wall * 9 / 10);
  EXPECT_GE(observed, 10u);
}

}  // namespace
}  // namespace vip_slam
