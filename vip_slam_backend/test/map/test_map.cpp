// SPDX-License-Identifier: BSD-3-Clause
// The map's operations keep its invariants; operations that would break them are refused and change nothing.
#include <gtest/gtest.h>

#include "map/map_fixture.h"
#include "vip_slam_backend/map/culling.h"
#include "vip_slam_backend/map/reobservation.h"

using namespace vip_slam;

TEST(Map, TracksBecomeLandmarks) {
  Fixture f;
  f.add(6);
  EXPECT_GT(f.map.landmarks().size(), 40u);
  std::size_t seen_often = 0;
  for (const auto& entry : f.map.landmarks()) seen_often += entry.second.observations.size() >= 3;
  EXPECT_GT(seen_often, 20u);
  const auto covisible = f.map.covisible(6);
  ASSERT_FALSE(covisible.empty());
  EXPECT_EQ(covisible.front().first, 5u);
}

// Also when a keyframe in between was culled, but not for keyframes of another session.
TEST(Map, AGyroThatIsKnownBetterIsIntegratedAnew) {
  Fixture f;
  f.add(5);
  f.map.removeKeyframe(3, ImuNoise(), 5.0);
  const KeyframePtr stored = f.addStored();
  const std::map<KeyframeId, MapKeyframe> before = f.map.keyframes();
  Eigen::Matrix3d correction;
  correction << -0.01, 0.002, 0, 0.003, 0.02, -0.001, 0.004, 0, -0.015;

  f.map.adoptGyroCorrection(correction, ImuNoise());
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.keyframe(stored->id).gyro_correction, Eigen::Matrix3d::Zero());
  for (const KeyframeId id : {2, 4, 5}) {
    const MapKeyframe& kf = f.map.keyframe(id);
    const NavState& from = f.map.keyframe(kf.previous).state;
    EXPECT_EQ(kf.imu, before.at(id).imu) << "samples stay as they were measured";
    std::vector<ImuSample> corrected = *kf.imu;
    for (ImuSample& sample : corrected) sample.gyro = (Eigen::Matrix3d::Identity() + correction) * sample.gyro;
    const Preintegration expected(corrected, from.bias_gyro, from.bias_accel, ImuNoise());
    EXPECT_LT((kf.preintegration->deltaR() - expected.deltaR()).norm(), 1e-12);
    EXPECT_GT((kf.preintegration->deltaR() - before.at(id).preintegration->deltaR()).norm(), 1e-5);
    const Eigen::Vector3d at_rest = before.at(id).state.bias_gyro;
    EXPECT_LT((kf.state.bias_gyro - (at_rest + correction * at_rest)).norm(), 1e-12);
  }
  // An IMU factor merged over a culled keyframe stays corrected when another keyframe is culled.
  f.map.removeKeyframe(4, ImuNoise(), 5.0);
  EXPECT_EQ(f.map.keyframe(5).gyro_correction, correction);
}

// The newest keyframe came with the correction, but its factor begins at a bias that the correction changes.
TEST(Map, AFactorFollowsTheBiasThatAGyroCorrectionChanges) {
  Fixture f;
  f.add(3);
  NavState biased = f.map.keyframe(3).state;
  biased.bias_gyro.setConstant(0.05);
  f.map.setState(3, biased, ImuNoise());
  const Eigen::Matrix3d correction = 0.3 * Eigen::Matrix3d::Identity();
  auto newest = std::make_shared<Keyframe>(*f.world.next());
  newest->gyro_correction = correction;
  f.map.addKeyframe(newest, f.world.truth(newest->frame.t), ImuNoise());
  f.map.adoptGyroCorrection(correction, ImuNoise());
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.keyframe(4).preintegration->biasGyro(), f.map.keyframe(3).state.bias_gyro);
}

TEST(Map, ExtrinsicsThatAreKnownBetterTurnBodiesAboutTheirCameras) {
  Fixture f;
  f.add(4);
  const KeyframePtr stored = f.addStored();
  RelativeMotion& motion = f.map.keyframe(3).motion;
  motion.T_a_b = f.map.keyframe(2).state.T_W_I.inverse() * f.map.keyframe(3).state.T_W_I;
  std::map<KeyframeId, MapKeyframe> before = f.map.keyframes();

  const SE3 T_I_C = before.at(1).T_I_C * SE3(expQuaternion({0.02, -0.01, 0.015}), {0.01, 0.02, -0.01});
  f.map.adoptExtrinsics(T_I_C);
  EXPECT_EQ(checkMap(f.map), "");
  for (const auto& [id, kf] : f.map.keyframes()) {
    EXPECT_LT(kf.T_W_C().boxminus(before.at(id).T_W_C()).norm(), 1e-12) << id;
    const SE3& expected = id == stored->id ? before.at(id).T_I_C : T_I_C;
    EXPECT_EQ(kf.T_I_C.matrix(), expected.matrix()) << id;
  }
  // The odometry's motion between them is that of the same cameras.
  const SE3 between = f.map.keyframe(2).state.T_W_I.inverse() * f.map.keyframe(3).state.T_W_I;
  EXPECT_LT(f.map.keyframe(3).motion.T_a_b.boxminus(between).norm(), 1e-12);
}

TEST(Map, DepthThatIsKnownBetterHoldsForAllKeyframesButStoredOnes) {
  Fixture f;
  f.add(4);
  const KeyframePtr stored = f.addStored();
  const PlaneUpdate planes = f.world.planes();
  for (const PlaneEstimate& plane : planes.planes) f.map.setPlane(plane);
  PlaneObservation observation = planes.observations.at(0);
  for (const KeyframeId id : {KeyframeId{2}, stored->id}) {
    observation.keyframe = id;
    ASSERT_TRUE(f.map.setPlaneObservation(observation));
  }
  const std::map<KeyframeId, MapKeyframe> before = f.map.keyframes();

  f.map.adoptCameraCorrection({-0.01, {}});
  EXPECT_EQ(checkMap(f.map), "");
  for (const auto& [id, kf] : f.map.keyframes()) {
    const float change = id == stored->id ? 0.0f : -0.01f;
    for (std::size_t k = 0; k < kf.features().size(); ++k) {
      const float z = before.at(id).features()[k].depth;
      EXPECT_FLOAT_EQ(kf.features()[k].depth, z > 0 ? z + change : z);
    }
    for (const auto& [plane, o] : kf.planes)
      EXPECT_FLOAT_EQ(o.points[0].p_C.z(), observation.points[0].p_C.z() + change) << id;
    if (id == 1 || id == stored->id) continue;
    ASSERT_TRUE(kf.imu);
    EXPECT_EQ(kf.imu.get(), &kf.data->imu);
    EXPECT_EQ(kf.imu->size(), before.at(id).imu->size());
  }
  // An observation made from uncorrected readings is corrected when it is added.
  observation.keyframe = 3;
  ASSERT_TRUE(f.map.setPlaneObservation(observation));
  const PlaneObservation& late = f.map.keyframe(3).planes.at(observation.plane);
  EXPECT_FLOAT_EQ(late.points[0].p_C.z(), observation.points[0].p_C.z() - 0.01f);
  EXPECT_EQ(late.camera_correction.offset, -0.01);
}

TEST(Map, AWaitingTrackThatWasRecognisedJoinsThatLandmark) {
  // Track 900 has no depth; while it waits, its first view is matched with landmark 800.
  Map map;
  LandmarkMaker maker{500.0};
  for (KeyframeId id = 1; id <= 4; ++id) {
    auto kf = std::make_shared<Keyframe>();
    kf->id = id;
    kf->frame.t = 0.3 * id;
    Feature f;
    f.id = 900;
    f.xy = Eigen::Vector2f(-0.1f * id, 0.0f);
    kf->frame.features.push_back(f);
    if (id == 2) {
      f.id = 800;
      f.depth = 2;
      f.depth_sigma = 0.01f;
      kf->frame.features.push_back(f);
    }
    NavState state;
    state.T_W_I = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2 * id, 0, 0));
    map.addKeyframe(kf, state, ImuNoise());
    ASSERT_NO_THROW(maker.process(id, &map));
    if (id == 2) ASSERT_TRUE(map.addObservation(800, {1, 0}));
    ASSERT_EQ(checkMap(map), "");
  }
  EXPECT_FALSE(map.hasLandmark(900));
  EXPECT_GE(map.landmark(800).observations.size(), 3u);
}

// Texture repeats itself: points seen by a new odometry at its guessed pose may differ from the map points there.
TEST(Map, LandmarksOfAPartThatNothingTiesAreNotMet) {
  for (const bool tied : {true, false}) {
    Fixture f;
    f.add(4);
    const auto allowed = [tied](KeyframeId id) { return tied || id > 4; };
    const KeyframePtr kf = f.world.next();  // tracks go on under their names
    f.map.addKeyframe(kf, f.world.truth(kf->frame.t), ImuNoise());
    f.maker.process(kf->id, &f.map, allowed);
    const bool meets = !f.map.covisible(kf->id).empty();
    EXPECT_EQ(meets, tied);
    // Some share landmarks already: by a track's id, or through a third keyframe.
    Fixture shared;
    shared.add(5);
    const Reobservation reobservation({}, makeCamera(shared.world.sensor().camera));
    EXPECT_EQ(reobservation.neighbours(shared.map, 5, allowed).empty(), !tied);
    EXPECT_EQ(checkMap(f.map), "");
  }
}

TEST(Map, RemovingAKeyframeJoinsTheImuChain) {
  Fixture f;
  f.add(5);
  const double before = f.map.keyframe(3).preintegration->dt() + f.map.keyframe(4).preintegration->dt();
  const RelativeMotion motion = compose(f.map.keyframe(3).motion, f.map.keyframe(4).motion);
  f.map.removeKeyframe(3, ImuNoise(), 3.0);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.keyframe(4).motion.covariance, motion.covariance);
  const SE3 T_2_4 = f.world.truth(f.map.keyframe(2).data->frame.t).T_W_I.inverse() *
                    f.world.truth(f.map.keyframe(4).data->frame.t).T_W_I;
  EXPECT_LT(f.map.keyframe(4).motion.T_a_b.boxminus(T_2_4).norm(), 0.02);
  EXPECT_EQ(f.map.keyframe(4).previous, 2u);
  EXPECT_NEAR(f.map.keyframe(4).preintegration->dt(), before, 1e-9);
  EXPECT_EQ(f.map.takeChanges().removed_keyframes, std::vector<KeyframeId>{3});
  // Too long a factor: the chain is cut instead.
  f.map.removeKeyframe(4, ImuNoise(), 0.5);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.keyframe(5).previous, 0u);
  EXPECT_FALSE(f.map.keyframe(5).preintegration);
  EXPECT_FALSE(f.map.keyframe(5).motion.known());
  f.map.removeKeyframe(5, ImuNoise(), 3.0);
  f.map.removeKeyframe(1, ImuNoise(), 3.0);
  f.map.removeKeyframe(2, ImuNoise(), 3.0);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_TRUE(f.map.landmarks().empty());
  EXPECT_THROW(f.map.keyframe(2), MapError);
}

TEST(Map, MergingLandmarks) {
  Fixture f;
  f.add(2);
  // Two landmarks of one keyframe cannot be one point.
  std::vector<LandmarkId> own;
  for (const LandmarkId id : f.map.keyframe(2).landmarks)
    if (id != kNoLandmark) own.push_back(id);
  ASSERT_GE(own.size(), 2u);
  EXPECT_FALSE(f.map.mergeLandmarks(own[0], own[1]));
  EXPECT_FALSE(f.map.mergeLandmarks(own[0], own[0]));
  // One only in keyframe 1 and one only in keyframe 2 can.
  LandmarkId only1 = kNoLandmark, only2 = kNoLandmark;
  for (const LandmarkId id : f.map.landmarkIds()) {
    const MapLandmark& l = f.map.landmark(id);
    if (l.observations.size() == 1) (l.host() == 1 ? only1 : only2) = id;
  }
  ASSERT_NE(only1, kNoLandmark);
  ASSERT_NE(only2, kNoLandmark);
  EXPECT_TRUE(f.map.mergeLandmarks(only2, only1));
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.resolve(only2), only1);
  EXPECT_EQ(f.map.landmark(only1).observations.size(), 2u);
  EXPECT_THROW(f.map.addLandmark(only2, Eigen::Vector3d::Zero(), {1, 0}), MapError);
}

TEST(Map, PlanesMergeAndGo) {
  Fixture f;
  f.add(3);
  const PlaneUpdate update = f.world.planes();
  for (const PlaneEstimate& plane : update.planes) f.map.setPlane(plane);
  for (const PlaneObservation& o : update.observations) EXPECT_TRUE(f.map.setPlaneObservation(o));
  ASSERT_GE(update.observations.size(), 2u);
  EXPECT_EQ(checkMap(f.map), "");
  const PlaneId a = update.observations[0].plane, b = update.observations[1].plane;
  const LandmarkId landmark = f.map.landmarkIds().front();
  f.map.associate(landmark, b);
  // The points' own moments add; what the readings share is counted once.
  const auto own = [](const PlaneObservation& o) { return Eigen::Matrix4d(o.G / o.weight_scale); };
  const PlaneObservation one = f.map.keyframe(3).planes.at(a), other = f.map.keyframe(3).planes.at(b);
  const Eigen::Matrix4d sum = own(one) + own(other);
  f.map.mergePlanes(b, a);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.landmark(landmark).plane, a);
  const PlaneObservation& joint = f.map.keyframe(3).planes.at(a);
  EXPECT_LT((own(joint) - sum).norm(), 1e-9 * sum.norm());
  EXPECT_LT(joint.weight_scale, std::min(one.weight_scale, other.weight_scale) + 1e-12);
  f.map.removePlane(a);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_EQ(f.map.landmark(landmark).plane, 0u);
  EXPECT_THROW(f.map.associate(landmark, a), MapError);
  PlaneObservation broken = update.observations[0];
  broken.plane = update.observations.back().plane;
  broken.G(0, 0) = std::nan("");
  EXPECT_FALSE(f.map.setPlaneObservation(broken));
  PlaneEstimate nan_plane = update.planes[0];
  nan_plane.plane.n.x() = std::nan("");
  EXPECT_THROW(f.map.setPlane(nan_plane), MapError);
}

// Samples that turn out to lie on something else are withdrawn by an observation without points.
TEST(Map, AnEmptyObservationWithdrawsTheOneBefore) {
  Fixture f;
  f.add(3);
  const PlaneUpdate update = f.world.planes();
  for (const PlaneEstimate& plane : update.planes) f.map.setPlane(plane);
  const PlaneObservation& seen = update.observations.at(0);
  ASSERT_TRUE(f.map.setPlaneObservation(seen));
  PlaneObservation none;
  none.keyframe = seen.keyframe;
  none.plane = seen.plane;
  EXPECT_TRUE(f.map.setPlaneObservation(none));
  EXPECT_TRUE(f.map.keyframe(seen.keyframe).planes.empty());
  EXPECT_EQ(checkMap(f.map), "");
}

TEST(Map, CorrectionMovesLandmarksWithTheirHost) {
  Fixture f;
  f.add(4);
  const SE3 shift(expQuaternion(Eigen::Vector3d(0, 0, 0.3)), Eigen::Vector3d(1, 2, 0));
  std::map<KeyframeId, SE3> poses;
  for (const auto& entry : f.map.keyframes()) poses[entry.first] = shift * entry.second.state.T_W_I;
  const LandmarkId id = f.map.landmarkIds().front();
  const Eigen::Vector3d p = f.map.landmark(id).p_W, v = f.map.keyframe(2).state.v_W;
  f.map.moveKeyframes(poses);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_LT((f.map.landmark(id).p_W - shift * p).norm(), 1e-9);
  EXPECT_LT((f.map.keyframe(2).state.v_W - shift.rotation() * v).norm(), 1e-9);
}

TEST(Map, CullingKeepsTheMapValid) {
  Fixture f;
  f.add(40);
  const std::size_t landmarks = f.map.landmarks().size();
  EXPECT_GT(cullLandmarks(39, &f.map), 0);
  EXPECT_LT(f.map.landmarks().size(), landmarks);
  EXPECT_EQ(checkMap(f.map), "");
  CullingOptions options;
  options.redundancy = 0.5;
  options.above_keyframes = 20;
  const auto removed = cullKeyframes(options, 20, ImuNoise(), {}, &f.map);
  EXPECT_FALSE(removed.empty());
  EXPECT_EQ(checkMap(f.map), "");
  for (const auto& entry : f.map.keyframes())
    if (entry.second.preintegration) EXPECT_LE(entry.second.preintegration->dt(), options.max_imu_seconds + 1e-9);
}

// An object in front of a landmark occludes it in keyframes into which it is predicted: many views of a track outweigh
// these misses.
TEST(Map, LandmarksOfManyViewsAreKeptHoweverOftenTheyAreHidden) {
  Fixture f;
  f.add(30);
  LandmarkId proven = kNoLandmark, doubtful = kNoLandmark, of_three = kNoLandmark;
  for (const LandmarkId id : f.map.landmarkIds()) {
    const MapLandmark& l = f.map.landmark(id);
    if (l.observations.back().keyframe >= 16) continue;
    if (l.observations.size() > 3) proven = id;
    if (l.observations.size() == 3) (doubtful == kNoLandmark ? doubtful : of_three) = id;
  }
  ASSERT_NE(proven, kNoLandmark);
  ASSERT_NE(of_three, kNoLandmark);
  f.map.landmark(proven).visible = f.map.landmark(doubtful).visible = 40;
  cullLandmarks(16, &f.map);
  EXPECT_TRUE(f.map.hasLandmark(proven));
  EXPECT_TRUE(f.map.hasLandmark(of_three));
  EXPECT_FALSE(f.map.hasLandmark(doubtful));
  EXPECT_EQ(checkMap(f.map), "");
}
