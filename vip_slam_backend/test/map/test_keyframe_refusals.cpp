// SPDX-License-Identifier: BSD-3-Clause
// Keyframes that the map refuses, each with its reason; a refusal changes nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "map/map_fixture.h"
#include "vip_slam_backend/map/map_limits.h"

using namespace vip_slam;

namespace {

const float kNanf = std::nanf("");

/// Something wrong with the keyframe itself, wherever it comes from.
struct BadKeyframe {
  const char* reason;
  std::function<void(Keyframe*)> spoil;
};

std::function<void(Keyframe*)> withGrid(const DepthGrid& grid) {
  return [grid](Keyframe* kf) { kf->frame.depth_grid = grid; };
}

const std::vector<BadKeyframe>& badKeyframes() {
  static const std::vector<BadKeyframe> all = {
      {"stamp is not finite", [](Keyframe* kf) { kf->frame.t = kNan; }},
      {"state is not finite", [](Keyframe* kf) { kf->frame.state.t = kNan; }},
      {"state is not finite", [](Keyframe* kf) { kf->frame.state.T_W_I.t().z() = kNan; }},
      {"state is not finite", [](Keyframe* kf) { kf->frame.state.v_W.z() = kNan; }},
      {"state is not finite", [](Keyframe* kf) { kf->frame.state.bias_gyro.z() = kNan; }},
      {"state is not finite", [](Keyframe* kf) { kf->frame.state.bias_accel.z() = kNan; }},
      {"extrinsics are not finite", [](Keyframe* kf) { kf->frame.T_I_C.t().y() = kNan; }},
      {"chained pose is not finite", [](Keyframe* kf) { kf->frame.T_chain_C.t().y() = kNan; }},
      {"the camera's delay is not finite", [](Keyframe* kf) { kf->frame.time_offset = kNan; }},
      {"depth grid without a stride", withGrid({0, 0, 1, 1, {2.f}})},
      {"depth grid of 3 nodes, expected 2 x 2", withGrid({8, 0, 2, 2, {1.f, 1.f, 1.f}})},
      {"depth grid of 0 nodes", withGrid({8, 0, -1, 0, {}})},
      {"depth grid of 0 nodes", withGrid({8, 0, 0, -1, {}})},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].pixel.x() = kNanf; }},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].xy.y() = kNanf; }},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].depth = kNanf; }},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].depth_sigma = kNanf; }},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].pixel_sigma = kNanf; }},
      {"feature 3 is not finite", [](Keyframe* kf) { kf->frame.features[3].angle = kNanf; }},
      {"feature 4 has depth -1", [](Keyframe* kf) { kf->frame.features[4].depth = -1; }},
      {"feature 4 has depth 2",
       [](Keyframe* kf) { kf->frame.features[4].depth = 2, kf->frame.features[4].depth_sigma = 0; }},
      {"IMU sample 6 is not finite", [](Keyframe* kf) { kf->imu[6].t = kNan; }},
      {"IMU sample 6 is not finite", [](Keyframe* kf) { kf->imu[6].gyro.x() = kNan; }},
      {"IMU sample 6 is not finite", [](Keyframe* kf) { kf->imu[6].accel.x() = kNan; }},
      {"is not after the one before", [](Keyframe* kf) { kf->imu[6].t = kf->imu[5].t; }},
      {"IMU sample 6 turns by 1.1e+10 rad/s, at most 1e+10",
       [](Keyframe* kf) { kf->imu[6].gyro.x() = 1.1 * map_limits::kLargest; }},
      {"IMU sample 6 reads 1.1e+10 m/s^2, at most 1e+10",
       [](Keyframe* kf) { kf->imu[6].accel.x() = 1.1 * map_limits::kLargest; }},
      {"IMU samples span 1100", [](Keyframe* kf) { kf->imu.back().t += 1.1 * map_limits::kLargest; }},
      {"the camera's correction: depth offset", [](Keyframe* kf) { kf->frame.camera_correction.offset = kNan; }},
      {"the gyro's correction is not finite", [](Keyframe* kf) { kf->gyro_correction(0, 1) = kNan; }},
      {"or could turn rates round", [](Keyframe* kf) { kf->gyro_correction(0, 1) = -1.1; }},
      {"the scale of the IMU's noise is 0", [](Keyframe* kf) { kf->imu_noise_scale.density = 0; }},
      {"the scale of the IMU's noise is nan", [](Keyframe* kf) { kf->imu_noise_scale.density = kNan; }},
      {"the scale of the IMU's noise is",
       [](Keyframe* kf) { kf->imu_noise_scale.density = 1.1 * map_limits::kLargest; }},
      {"of its random walks 0 (gyroscope)", [](Keyframe* kf) { kf->imu_noise_scale.gyro_walk = 0; }},
      {"of its random walks 1.1e+10", [](Keyframe* kf) { kf->imu_noise_scale.gyro_walk = 1.1 * map_limits::kLargest; }},
      {"and nan (accelerometer)", [](Keyframe* kf) { kf->imu_noise_scale.accel_walk = kNan; }},
      {"the parts of the depth noise are nan", [](Keyframe* kf) { kf->depth_noise.white = kNan; }},
      {"(white) and -1 (shared)", [](Keyframe* kf) { kf->depth_noise.shared = -1; }},
      {"the odometry's motion is not finite", [](Keyframe* kf) { kf->motion.T_a_b.t().x() = kNan; }},
      {"its covariance is none", [](Keyframe* kf) { kf->motion.covariance(2, 2) = -1e-6; }},
      {"keyframe without an id", [](Keyframe* kf) { kf->id = 0; }},
  };
  return all;
}

struct Refusals : Fixture {
  KeyframePtr good;
  Refusals() {
    add(3);
    addPlanes();
    good = world.next();
  }
  KeyframePtr spoilt(const std::function<void(Keyframe*)>& spoil) const {
    auto bad = std::make_shared<Keyframe>(*good);
    spoil(bad.get());
    return bad;
  }
  NavState state() const { return world.truth(good->frame.t); }
  void expectNew(const std::string& reason, const KeyframePtr& keyframe, const NavState& state) {
    expectRefused(&map, reason, [&] { map.addKeyframe(keyframe, state, ImuNoise()); });
  }
  void expectStored(const std::string& reason, const KeyframePtr& keyframe, const NavState& state, KeyframeId previous,
                    const std::vector<ImuSample>& imu) {
    expectRefused(&map, reason, [&] { map.restoreKeyframe(keyframe, state, previous, imu, ImuNoise()); });
  }
};

}  // namespace

TEST(KeyframeRefusals, WhateverIsWrongInAKeyframeIsNamed) {
  Refusals f;
  for (const BadKeyframe& bad : badKeyframes()) {
    const KeyframePtr keyframe = f.spoilt(bad.spoil);
    EXPECT_NE(validateKeyframe(*keyframe).find(bad.reason), std::string::npos)
        << validateKeyframe(*keyframe) << "\nexpected: " << bad.reason;
    f.expectNew(keyframe->id == 0 ? "keyframe 0 is not newer" : bad.reason, keyframe, f.state());
    f.expectStored(bad.reason, keyframe, f.state(), 3, f.good->imu);
  }
  f.map.addKeyframe(f.good, f.state(), ImuNoise());
  EXPECT_EQ(checkMap(f.map), "");
}

// Of an empty map every keyframe is newer.
TEST(KeyframeRefusals, TheFirstKeyframeNeedsAnIdToo) {
  Refusals f;
  f.map.clear();
  f.expectNew("is not newer than keyframe 0", f.spoilt([](Keyframe* kf) { kf->id = 0; }), f.state());
}

TEST(KeyframeRefusals, AKeyframeThatDoesNotFollowTheMapIsNamed) {
  Refusals f;
  NavState nowhere = f.state();
  nowhere.bias_accel.y() = kNan;
  f.expectNew("no keyframe given", nullptr, f.state());
  f.expectNew("state in the map is not finite", f.good, nowhere);
  f.expectNew("not newer than keyframe 3", f.spoilt([](Keyframe* kf) { kf->id = 3; }), f.state());
  f.expectNew("too far from the first one, 1", f.spoilt([](Keyframe* kf) { kf->id = 2 + map_limits::kWidestIds; }),
              f.state());
  for (const double t : {0.5, 0.6})  // before, and at the same time
    f.expectNew("stamp is not after that of its previous keyframe 3", f.spoilt([=](Keyframe* kf) { kf->frame.t = t; }),
                f.state());
  f.expectNew("its IMU samples begin before those of its previous keyframe end",
              f.spoilt([](Keyframe* kf) { kf->imu.front().t -= 1e-3; }), f.state());
}

// Samples that tell another motion than that between the two images make no factor.
TEST(KeyframeRefusals, ImuOfAnotherDurationThanTheStampsMakesNoFactor) {
  for (const double longer : {0.0, 0.04, 0.1, -0.1}) {
    Refusals f;
    f.map.addKeyframe(f.spoilt([=](Keyframe* kf) { kf->frame.t += longer; }), f.state(), ImuNoise());
    EXPECT_EQ(f.map.keyframe(4).preintegration != nullptr, std::abs(longer) < map_limits::kImuDuration) << longer;
    EXPECT_EQ(f.map.keyframe(4).previous, 3u);
    EXPECT_EQ(checkMap(f.map), "") << longer;
  }
  // Unless the delay of the camera was estimated anew.
  Refusals f;
  f.map.addKeyframe(f.spoilt([](Keyframe* kf) { kf->frame.t += 0.1, kf->frame.time_offset -= 0.1; }), f.state(),
                    ImuNoise());
  EXPECT_NE(f.map.keyframe(4).preintegration, nullptr);
  EXPECT_EQ(checkMap(f.map), "");
}

// Each within the tolerance, but not both together.
TEST(KeyframeRefusals, ImuThatDisagreesWithTheStampsIsNotJoined) {
  for (const double longer : {0.01, 0.04}) {
    Refusals f;
    f.map.addKeyframe(f.spoilt([=](Keyframe* kf) { kf->frame.t += longer; }), f.state(), ImuNoise());
    f.good = f.world.next();
    f.map.addKeyframe(f.spoilt([=](Keyframe* kf) { kf->frame.t += 2 * longer; }), f.state(), ImuNoise());
    ASSERT_NE(f.map.keyframe(5).preintegration, nullptr);
    f.map.removeKeyframe(4, ImuNoise(), 10);
    EXPECT_EQ(f.map.keyframe(5).previous, 2 * longer < map_limits::kImuDuration ? 3u : 0u);
    EXPECT_EQ(checkMap(f.map), "") << longer;
  }
}

TEST(KeyframeRefusals, AStoredKeyframeThatDoesNotFitTheMapIsNamed) {
  Refusals f;
  NavState nowhere = f.state();
  nowhere.v_W.y() = kNan;
  const std::vector<ImuSample>& imu = f.good->imu;
  f.expectStored("no keyframe given", nullptr, f.state(), 3, imu);
  f.expectStored("state in the map is not finite", f.good, nowhere, 3, imu);
  f.expectStored("keyframe 3 exists already", f.spoilt([](Keyframe* kf) { kf->id = 3; }), f.state(), 0, {});
  f.expectStored("previous keyframe 99 is missing", f.good, f.state(), 99, imu);
  f.expectStored("previous keyframe 2 is missing or has a successor", f.good, f.state(), 2, imu);
  f.expectStored("previous keyframe 3 is of another odometry", f.spoilt([](Keyframe* kf) { kf->frame.epoch = 2; }),
                 f.state(), 3, imu);
  f.expectStored("or not before it", f.spoilt([](Keyframe* kf) { kf->frame.t = 0.6; }), f.state(), 3, imu);
  std::vector<ImuSample> bad = imu;
  bad[5].gyro.x() = kNan;
  f.expectStored("IMU sample 5 is not finite", f.good, f.state(), 3, bad);
}

// A file may hold samples of which none of the map's own keyframes would make a factor.
TEST(KeyframeRefusals, StoredImuThatDoesNotContinueTheChainMakesNoFactor) {
  for (const double later : {0.0, 0.01, -0.01}) {
    Refusals f;
    std::vector<ImuSample> imu = f.good->imu;
    for (ImuSample& sample : imu) sample.t += later;
    f.map.restoreKeyframe(f.good, f.state(), 3, imu, ImuNoise());
    EXPECT_EQ(f.map.keyframe(4).preintegration != nullptr, later == 0) << later;
    EXPECT_EQ(checkMap(f.map), "") << later;
  }
}

// Nothing measured without noise can be integrated: each operation that would integrate leaves the map as it was.
TEST(KeyframeRefusals, WhatCannotBeIntegratedIsNamed) {
  Refusals f;
  ImuNoise none;
  none.gyro_random_walk = 0;
  const std::string reason = "IMU samples: preintegration: covariance is not positive definite";
  expectRefused(&f.map, "keyframe 4: " + reason, [&] { f.map.addKeyframe(f.good, f.state(), none); });
  expectRefused(&f.map, "keyframe 4: " + reason,
                [&] { f.map.restoreKeyframe(f.good, f.state(), 3, f.good->imu, none); });
  NavState biased = f.map.keyframe(2).state;
  biased.bias_accel.x() += 1;
  expectRefused(&f.map, "keyframe 3: " + reason, [&] { f.map.setState(2, biased, none); });
  expectRefused(&f.map, "keyframe 2: " + reason, [&] { f.map.widenImuNoise(2, 2.0, none); });
  expectRefused(&f.map, "keyframe 3: " + reason, [&] { f.map.removeKeyframe(2, none, 10); });
  expectRefused(&f.map, "keyframe 2: " + reason,
                [&] { f.map.adoptGyroCorrection(0.01 * Eigen::Matrix3d::Identity(), none); });
  biased.bias_accel.x() = 1e200;  // finite, but not its products
  expectRefused(&f.map, "keyframe 3: IMU samples: their integral is not finite",
                [&] { f.map.setState(2, biased, ImuNoise()); });
}
