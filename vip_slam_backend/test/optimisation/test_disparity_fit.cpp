// SPDX-License-Identifier: BSD-3-Clause
// A constant error of all disparities: found when it is there, together with the depth offset and scale it implies.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "back_end/checked_back_end.h"
#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/optimisation/disparity_fit.h"
#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

constexpr double kError = 0.002;  // 1/m
double tooLong(double z) { return z / (1 + kError * z) - z; }

DepthNoise stereo() {
  DepthNoise noise;
  noise.type = DepthSensorType::kStereo;
  return noise;
}

std::optional<double> errorOf(std::function<double(double)> read_too_long, const DepthNoise& noise = stereo(),
                              int keyframes = 60, double sigma = 0.004, bool again = false) {
  SimulatedKeyframes world(3);
  world.setDepthCamera(std::move(read_too_long), sigma);
  return fitDisparityError(mapAtTruePoses(&world, keyframes), noise, again);
}

TEST(DisparityFit, FindsTheErrorAndWhatComesWithIt) {
  const auto found = errorOf(tooLong);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, kError, 1e-4);
  const auto other = errorOf([](double z) { return z / (1 - 0.001 * z) - z; });
  ASSERT_TRUE(other);
  EXPECT_NEAR(*other, -0.001, 1e-4);
}

// Noise that grows with the square of the distance, twice as large as the error at 4 m: readings that are too short by
// chance must not get a larger weight.
TEST(DisparityFit, IsNotMisledByNoise) {
  DepthNoise noise = stereo();
  noise.a = 0.001, noise.b = 0, noise.c = 0.0035;
  for (const unsigned seed : {3u, 4u, 5u}) {
    SimulatedKeyframes world(seed);
    world.setDepthCamera(exact, 0.03);
    EXPECT_FALSE(fitDisparityError(mapAtTruePoses(&world, 60), noise, false)) << seed;
  }
}

TEST(DisparityFit, FindsNothingInWhatIsExact) {
  EXPECT_FALSE(errorOf(exact));
  EXPECT_FALSE(errorOf(exact, stereo(), 60, 0.0005));
}

TEST(DisparityFit, LeavesOffsetAndScaleAlone) {
  EXPECT_FALSE(errorOf([](double) { return 0.02; }));
  EXPECT_FALSE(errorOf([](double z) { return 0.01 * z; }));
}

TEST(DisparityFit, ASmallErrorIsBelievedOnlyAfterALargeOne) {
  const auto small = [](double z) { return z / (1 + 1e-4 * z) - z; };
  EXPECT_FALSE(errorOf(small));
  const auto found = errorOf(small, stereo(), 60, 0.004, true);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 1e-4, 5e-5);
}

TEST(DisparityFit, IsNotAskedOfOtherCamerasOrOfTooLittle) {
  DepthNoise tof = stereo();
  tof.type = DepthSensorType::kTof;
  EXPECT_FALSE(errorOf(tooLong, tof));
  EXPECT_FALSE(errorOf(tooLong, stereo(), 9));
  SimulatedKeyframes world(3);
  world.setDepthCamera(tooLong, 0.004);
  Map map = mapAtTruePoses(&world, 60);
  for (KeyframeId id = 1; id <= 60; ++id) map.keyframe(id).stored = true;
  EXPECT_FALSE(fitDisparityError(map, stereo(), false));
}

// A wall whose far part is set back by 4 cm is mapped as one plane.
TEST(DisparityFit, SurfacesThatPassForOneAreNoErrorOfTheCamera) {
  SimulatedKeyframes world(3);
  world.setDepthCamera(exact, 0.004);
  Map map = mapAtTruePoses(&world, 60);
  for (KeyframeId id = 1; id <= 60; ++id) {
    const auto seen = map.keyframe(id).planes.find(1);
    if (seen == map.keyframe(id).planes.end()) continue;
    for (PlaneSample& point : seen->second.points) {
      if (point.p_C.z() > 3) point.p_C *= 1 + 0.04f / point.p_C.z();
    }
  }
  EXPECT_FALSE(fitDisparityError(map, stereo(), false));
}

TEST(DisparityFit, WhatNoCalibrationExplainsIsNotBelieved) {
  EXPECT_FALSE(errorOf([](double z) { return z / (1 + 0.02 * z) - z; }));
  EXPECT_TRUE(errorOf([](double z) { return z / (1 + 0.004 * z) - z; }));
}

// An error of a pose shifts all points of the keyframe alike: it counts as one error, not as hundreds. Chance exceeds
// three of the sigmas that 20 groups of keyframes give in 0.74% of maps (Student's t, 19 degrees of freedom), so in
// more than one of 40 with a probability of 3.5%.
TEST(DisparityFit, PosesThatAreOffAreNotMistakenForManyErrors) {
  int found = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SimulatedKeyframes world(seed);
    world.setDepthCamera(exact, 0.004);
    Map map = mapAtTruePoses(&world, 60);
    for (KeyframeId id = 1; id <= 60; ++id) {
      NavState& state = map.keyframe(id).state;
      Vector6d off;
      off << Eigen::Vector3d::Zero(), world.gauss(0.02), world.gauss(0.02), world.gauss(0.02);
      state.T_W_I = state.T_W_I.boxplus(off);
    }
    found += fitDisparityError(map, stereo(), false).has_value();
  }
  std::printf("found in %d of 40 maps of exact depth with poses that are off by 2 cm\n", found);
  EXPECT_LE(found, 1);
}

TEST(DisparityFit, TellsTheUser) {
  EXPECT_EQ(disparityDifference(0), "");
  EXPECT_NE(disparityDifference(-0.002).find("too long by more the farther, 2.0 mm at 1 m and 17.9 mm at 3 m"),
            std::string::npos);
}

// End to end: the depth offset which the front end estimated in its place is withdrawn.
TEST(DisparityFit, WhatTheBackEndLearnsTakesThePlaceOfTheOffset) {
  SimulatedKeyframes world(6);
  world.setDepthCamera(tooLong, 0.004);
  BackEndOptions options;
  options.disparity = true;
  options.lockstep = true;
  options.loop_closing = false;
  options.variant = "vi";  // so that plane factors do not pull the poses
  SensorConfig sensor = world.sensor();
  sensor.depth_noise.type = DepthSensorType::kStereo;
  CheckedBackEnd back_end(options, sensor);
  MapUpdate update;
  int with_offset = 0;
  for (int k = 0; k < 60; ++k) {
    auto read = std::make_shared<Keyframe>(*world.next());
    for (Feature& f : read->frame.features) f.depth = 0;
    // Until it knows the disparity error the front end estimates it as an offset; keyframes in transit still carry
    // that.
    const bool known = back_end.disparityError() != 0 && k % 2 == 1;
    with_offset += back_end.disparityError() == 0;
    const KeyframePtr keyframe =
        withCameraCorrection(read, known ? CameraCorrection{0.0, update.depth_curve} : CameraCorrection{0.008, {}});
    update = back_end.addKeyframe(keyframe);
    ASSERT_EQ(back_end.lastRefusal(), "");
    back_end.applyPlaneUpdate(world.planes());
    if (back_end.globalBaWanted()) update = back_end.merge(back_end.run(back_end.startGlobalBa()));
  }
  update = back_end.finish();
  EXPECT_GE(with_offset, 20);
  EXPECT_LT(with_offset, 60);
  EXPECT_NEAR(back_end.disparityError(), kError, 4e-4);
  EXPECT_EQ(update.disparity_error, back_end.disparityError());
  EXPECT_NEAR(update.depth_curve.at(3.f), addedForDisparity(kError, 3), 4e-3);
  EXPECT_FALSE(back_end.depthDifference().empty());
  for (const auto& [id, kf] : back_end.map().keyframes()) {
    EXPECT_EQ(kf.data->frame.camera_correction, (CameraCorrection{0.0, update.depth_curve}));
  }
  back_end.reset();
  EXPECT_EQ(back_end.disparityError(), 0.0);
  EXPECT_EQ(back_end.addKeyframe(world.next()).disparity_error, 0.0);
}

}  // namespace
}  // namespace vip_slam
