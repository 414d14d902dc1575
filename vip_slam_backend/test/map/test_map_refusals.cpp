// SPDX-License-Identifier: BSD-3-Clause
// Operations on landmarks, planes and states that the map refuses, each with its reason; a refusal changes nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "map/map_fixture.h"

using namespace vip_slam;

namespace {

const Eigen::Vector3d kNanVector(0, kNan, 0);
const SE3 kNanPose(Eigen::Quaterniond::Identity(), kNanVector);

struct Refused {
  std::string reason;
  std::function<void()> operation;
};

/// A map with two landmarks that no keyframe shares, one of them under a second name, and planes.
struct Populated : Fixture {
  Populated() {
    add(4);
    addPlanes();
    const LandmarkId old = findLandmark(map, [](const MapLandmark& l) { return l.observations.back().keyframe == 1; });
    merged = findLandmark(map, [](const MapLandmark& l) { return l.host() > 2; });
    EXPECT_TRUE(map.mergeLandmarks(merged, old));
    often = findLandmark(map, [](const MapLandmark& l) { return l.observations.size() >= 3; });
    map.takeChanges();
  }
  LandmarkId merged = kNoLandmark, often = kNoLandmark;
  void expectRefusals(const std::vector<Refused>& all) {
    for (const Refused& refused : all) expectRefused(&map, refused.reason, refused.operation);
  }
};

}  // namespace

TEST(MapRefusals, OfLandmarks) {
  Populated f;
  Map& map = f.map;
  const Eigen::Vector3d p(1, 2, 3);
  const MapObservation free = freeFeature(map, 2), taken = map.landmark(f.often).observations.front();
  const std::string often = "landmark " + std::to_string(f.often);
  f.expectRefusals({
      {"a landmark needs an id", [&] { map.addLandmark(kNoLandmark, p, free); }},
      {often + " exists already", [&] { map.addLandmark(f.often, p, free); }},
      {"exists already", [&] { map.addLandmark(f.merged, p, free); }},
      {"position is not finite", [&] { map.addLandmark(987654, kNanVector, free); }},
      {"no keyframe 99",
       [&] {
         map.addLandmark(987654, p, {99, 0});
       }},
      {"no such feature",
       [&] {
         map.addLandmark(987654, p, {2, 100000});
       }},
      {"its feature has a landmark already", [&] { map.addLandmark(987654, p, taken); }},
      {"no landmark 987654", [&] { map.addObservation(987654, free); }},
      {"no keyframe 99",
       [&] {
         map.addObservation(f.often, {99, 0});
       }},
      {often + ": no such feature",
       [&] {
         map.addObservation(f.often, {2, 100000});
       }},
      {"no landmark 987654", [&] { map.removeObservation(987654, 1); }},
      {"no landmark 987654", [&] { map.removeLandmark(987654); }},
      {"no landmark 987654", [&] { map.mergeLandmarks(987654, f.often); }},
      {"no landmark 987654", [&] { map.mergeLandmarks(f.often, 987654); }},
      {often + ": new position is not finite", [&] { map.setPosition(f.often, kNanVector); }},
      {"no landmark 987654", [&] { map.setPosition(987654, p); }},
      {"no landmark 987654", [&] { map.associate(987654, 1); }},
      {"no plane 99", [&] { map.associate(f.often, 99); }},
  });
}

TEST(MapRefusals, OfStoredLandmarks) {
  Populated f;
  MapLandmark good;
  good.id = 987654;
  good.observations = {freeFeature(f.map, 1), freeFeature(f.map, 2)};
  const auto restoring = [&](const std::function<void(MapLandmark*)>& spoil) {
    MapLandmark bad = good;
    spoil(&bad);
    return [&f, bad] { f.map.restoreLandmark(bad); };
  };
  const MapObservation taken = f.map.landmark(f.often).observations.front();
  f.expectRefusals({
      {"a landmark needs an id", restoring([](MapLandmark* l) { l->id = kNoLandmark; })},
      {"exists already", restoring([&](MapLandmark* l) { l->id = f.often; })},
      {"exists already", restoring([&](MapLandmark* l) { l->id = f.merged; })},
      {"position is not finite", restoring([](MapLandmark* l) { l->p_W = kNanVector; })},
      {"plane that is not in the map", restoring([](MapLandmark* l) { l->plane = 99; })},
      {"no observation", restoring([](MapLandmark* l) { l->observations.clear(); })},
      {"not ascending", restoring([](MapLandmark* l) { std::swap(l->observations[0], l->observations[1]); })},
      {"not ascending", restoring([](MapLandmark* l) { l->observations[1].keyframe = 1; })},
      {"no keyframe 99", restoring([](MapLandmark* l) { l->observations[1].keyframe = 99; })},
      {"in keyframe 2 is unknown or taken", restoring([](MapLandmark* l) { l->observations[1].feature = 100000; })},
      {"is unknown or taken", restoring([&](MapLandmark* l) { l->observations = {taken}; })},
  });
  f.map.restoreLandmark(good);
  EXPECT_EQ(checkMap(f.map), "");
}

// These say no by their result, or do nothing.
TEST(MapRefusals, OfWhatIsThereAlreadyOrNotThere) {
  Populated f;
  const MapLandmark& often = f.map.landmark(f.often);
  const auto sees = [&](KeyframeId id) {
    return std::any_of(often.observations.begin(), often.observations.end(),
                       [id](const MapObservation& o) { return o.keyframe == id; });
  };
  const LandmarkId together =
      findLandmark(f.map, [&](const MapLandmark& l) { return l.id != f.often && sees(l.host()); });
  const LandmarkId elsewhere = findLandmark(f.map, [&](const MapLandmark& l) { return !sees(l.host()); });
  ASSERT_NE(together, kNoLandmark);
  ASSERT_NE(elsewhere, kNoLandmark);
  const std::string before = fingerprint(f.map);
  EXPECT_FALSE(f.map.addObservation(f.often, freeFeature(f.map, often.host()))) << "seen by that keyframe already";
  EXPECT_FALSE(f.map.addObservation(f.often, f.map.landmark(elsewhere).observations[0])) << "another's feature";
  EXPECT_FALSE(f.map.mergeLandmarks(f.often, together)) << "both seen by one keyframe";
  EXPECT_FALSE(f.map.mergeLandmarks(f.often, f.often));
  f.map.removeObservation(f.often, 99);
  f.map.mergePlanes(99, 1);
  f.map.mergePlanes(99, 98);
  f.map.mergePlanes(1, 1);
  f.map.removePlane(99);
  EXPECT_TRUE(fingerprint(f.map) == before);
}

TEST(MapRefusals, OfPlanes) {
  Populated f;
  Map& map = f.map;
  const auto setting = [&](const std::function<void(PlaneEstimate*)>& spoil) {
    PlaneEstimate bad = map.planes().at(1).estimate;
    spoil(&bad);
    return [&map, bad] { map.setPlane(bad); };
  };
  const Plane good = map.planes().at(1).estimate.plane;
  Plane far = good, none = good;
  far.d = kNan;
  none.n *= 1.01;
  f.expectRefusals({
      {"a plane needs an id", setting([](PlaneEstimate* e) { e->id = 0; })},
      {"plane 1: parameters", setting([](PlaneEstimate* e) { e->plane.n.z() = kNan; })},
      {"plane 1: parameters", setting([](PlaneEstimate* e) { e->plane.d = kNan; })},
      {"plane 1: normal of length 1.01", setting([](PlaneEstimate* e) { e->plane.n *= 1.01; })},
      {"plane 9: its area or outline", setting([](PlaneEstimate* e) { e->id = 9, e->area = kNan; })},
      {"plane 1: its area or outline", setting([](PlaneEstimate* e) {
         e->polygons = {{{kNanVector}, {}}};
       })},
      {"plane 1: its area or outline", setting([](PlaneEstimate* e) {
         e->polygons = {{{}, {{kNanVector}}}};
       })},
      {"plane 1: new parameters", [&] { map.setPlaneParameters(1, far); }},
      {"plane 1: new normal of length 1.01", [&] { map.setPlaneParameters(1, none); }},
      {"no plane 99", [&] { map.setPlaneParameters(99, good); }},
      {"plane 1: its motion", [&] { map.movePlane(1, kNanPose); }},
      {"no plane 99", [&] { map.movePlane(99, SE3()); }},
  });
}

// A solver's normal may be off by rounding; a map file's may not.
TEST(MapRefusals, ANearlyUnitNormalIsMadeAUnitVector) {
  Populated f;
  PlaneEstimate estimate = f.map.planes().at(1).estimate;
  estimate.plane.n *= 1.0005;
  f.map.setPlane(estimate);
  EXPECT_EQ(checkMap(f.map), "");
  f.map.setPlaneParameters(1, estimate.plane);
  EXPECT_EQ(checkMap(f.map), "");
  EXPECT_NEAR(f.map.planes().at(1).estimate.plane.n.norm(), 1.0, 1e-12);
}

TEST(MapRefusals, OfPlaneObservations) {
  Populated f;
  ASSERT_FALSE(f.map.keyframe(4).planes.empty());
  const PlaneObservation good = f.map.keyframe(4).planes.begin()->second;
  const std::vector<std::pair<const char*, std::function<void(PlaneObservation*)>>> all = {
      {"", [](PlaneObservation* o) { o->keyframe = 99; }},
      {"", [](PlaneObservation* o) { o->plane = 99; }},
      {"moments are not finite", [](PlaneObservation* o) { o->G(1, 2) = kNan; }},
      {"moments are no sum of squares", [](PlaneObservation* o) { o->G(1, 2) *= 1.001; }},
      {"moments are no sum of squares", [](PlaneObservation* o) { o->G = -o->G; }},
      {"moments are no sum of squares",
       [](PlaneObservation* o) { o->G = Eigen::Vector4d(4, 3, 2, -1e-6).asDiagonal(); }},
      {"weight is", [](PlaneObservation* o) { o->weight_scale = 0; }},
      {"weight is", [](PlaneObservation* o) { o->weight_scale = kNan; }},
      {"weight is", [](PlaneObservation* o) { o->weight_scale = HUGE_VAL; }},
      {"a point is not finite", [](PlaneObservation* o) { o->points[2].p_C.x() = std::nanf(""); }},
      {"a point is not finite", [](PlaneObservation* o) { o->points[2].sigma = std::nanf(""); }},
      {"a point is not finite", [](PlaneObservation* o) { o->points[2].sigma = HUGE_VALF; }},
      {"a point is not finite", [](PlaneObservation* o) { o->points[2].sigma = 0; }},
      {"the camera's correction: depth offset", [](PlaneObservation* o) { o->camera_correction.offset = kNan; }},
  };
  for (const auto& [reason, spoil] : all) {
    PlaneObservation bad = good;
    spoil(&bad);
    const std::string before = fingerprint(f.map);
    EXPECT_FALSE(f.map.setPlaneObservation(bad)) << reason;
    EXPECT_TRUE(fingerprint(f.map) == before) << reason;
    if (*reason) {
      EXPECT_NE(validateObservation(bad).find(reason), std::string::npos) << reason << "\n" << validateObservation(bad);
    } else {
      EXPECT_EQ(validateObservation(bad), "");
    }
  }
}

TEST(MapRefusals, OfStatesAndCorrections) {
  Populated f;
  Map& map = f.map;
  const ImuNoise noise;
  const auto stating = [&](const std::function<void(NavState*)>& spoil) {
    NavState bad = map.keyframe(2).state;
    spoil(&bad);
    return [&map, bad] { map.setState(2, bad, ImuNoise()); };
  };
  const NavState good = map.keyframe(2).state;
  Eigen::Matrix3d nan = Eigen::Matrix3d::Zero(), large = nan;
  nan(1, 2) = kNan;
  large(1, 2) = 1.1;
  f.expectRefusals({
      {"keyframe 2: new state", stating([](NavState* s) { s->t = kNan; })},
      {"keyframe 2: new state", stating([](NavState* s) { s->T_W_I = kNanPose; })},
      {"keyframe 2: new state", stating([](NavState* s) { s->v_W = kNanVector; })},
      {"keyframe 2: new state", stating([](NavState* s) { s->bias_gyro = kNanVector; })},
      {"keyframe 2: new state", stating([](NavState* s) { s->bias_accel = kNanVector; })},
      {"no keyframe 99", [&] { map.setState(99, good, noise); }},
      {"keyframe 3: new pose",
       [&] {
         map.moveKeyframes({{2, good.T_W_I}, {3, kNanPose}});
       }},
      {"no keyframe 99",
       [&] {
         map.moveKeyframes({{2, SE3()}, {99, SE3()}});
       }},
      {"no keyframe 99", [&] { map.removeKeyframe(99, noise, 1); }},
      {"no keyframe 99", [&] { map.widenImuNoise(99, 2, noise); }},
      {"no keyframe 99", [&] { map.widenMotion(99, 2); }},
      {"keyframe 2: factor on the odometry's covariance", [&] { map.widenMotion(2, 0); }},
      {"keyframe 2: factor on the odometry's covariance", [&] { map.widenMotion(2, kNan); }},
      {"keyframe 2: factor on the IMU's noise", [&] { map.widenImuNoise(2, 0, noise); }},
      {"keyframe 2: factor on the IMU's noise", [&] { map.widenImuNoise(2, -1, noise); }},
      {"keyframe 2: factor on the IMU's noise", [&] { map.widenImuNoise(2, kNan, noise); }},
      {"new extrinsics", [&] { map.adoptExtrinsics(kNanPose); }},
      {"new correction of the camera: depth offset",
       [&] {
         map.adoptCameraCorrection({kNan, {}});
       }},
      {"new correction of the gyro", [&] { map.adoptGyroCorrection(nan, noise); }},
      {"new correction of the gyro", [&] { map.adoptGyroCorrection(large, noise); }},
      {"no keyframe 99", [&] { map.covisible(99); }},
  });
  // A correction that takes a direction away could not be undone.
  Eigen::Matrix3d flat = Eigen::Matrix3d::Zero();
  flat.topLeftCorner<2, 2>().setConstant(-0.5);
  f.expectRefusals({{"new correction of the gyro", [&] { map.adoptGyroCorrection(flat, noise); }}});
}
