// SPDX-License-Identifier: BSD-3-Clause
// Depth curve estimated from a map: an existing error is found, and other errors are not mistaken for it.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "back_end/checked_back_end.h"
#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/optimisation/depth_curve_fit.h"

namespace vip_slam {
namespace {

constexpr double kWave = 4.1, kAmplitude = 0.004;  // a time-of-flight camera's, 1/m and m
double wiggle(double z) { return kAmplitude * std::sin(kWave * z); }

std::optional<DepthCurve> curveOf(std::function<double(double)> read_too_long, int keyframes = 60,
                                  double sigma = 0.004) {
  SimulatedKeyframes world(3);
  world.setDepthCamera(std::move(read_too_long), sigma);
  return fitDepthCurve(mapAtTruePoses(&world, keyframes), DepthNoise());
}

/// RMS of the curve plus the depth error, between 2 and 6 m, after removing offset and scale.
double leftOver(const DepthCurve& curve) {
  Eigen::MatrixX2d lines(32, 2);
  Eigen::VectorXd left(32);
  for (int k = 0; k < 32; ++k) {
    const double z = 2 + 0.125 * k;
    lines.row(k) << 1, z;
    left(k) = curve.at(static_cast<float>(z)) + wiggle(z);
  }
  left -= lines * (lines.transpose() * lines).ldlt().solve(lines.transpose() * left);
  return left.norm() / std::sqrt(32.0);
}

TEST(DepthCurveFit, FindsTheWiggleOfATimeOfFlightCamera) {
  const auto curve = curveOf(wiggle);
  ASSERT_TRUE(curve);
  EXPECT_GT(leftOver(DepthCurve()), 0.0025);
  EXPECT_LT(leftOver(*curve), 0.0006);
  // There are no readings at these depths.
  EXPECT_EQ(curve->at(0.0f), 0.0f);
  EXPECT_LT(std::abs(curve->at(8.0f)), 0.001f);
}

TEST(DepthCurveFit, FindsNothingInWhatIsExact) {
  EXPECT_FALSE(curveOf(exact, 60, 0.004));
  EXPECT_FALSE(curveOf(exact, 60, 0.0005));
  EXPECT_FALSE(curveOf(exact, 60, 0.03));
}

// Both are estimated elsewhere, see the header.
TEST(DepthCurveFit, LeavesOffsetAndScaleAlone) {
  EXPECT_FALSE(curveOf([](double) { return 0.02; }));
  EXPECT_FALSE(curveOf([](double z) { return 0.01 * z; }));
}

TEST(DepthCurveFit, WaitsForEnoughKeyframes) { EXPECT_FALSE(curveOf(wiggle, 9)); }

TEST(DepthCurveFit, SaysNothingOfAStoredMapsCamera) {
  SimulatedKeyframes world(3);
  world.setDepthCamera(wiggle, 0.004);
  Map map = mapAtTruePoses(&world, 60);
  for (KeyframeId id = 1; id <= 60; ++id) map.keyframe(id).stored = true;
  EXPECT_FALSE(fitDepthCurve(map, DepthNoise()));
}

TEST(DepthCurveFit, TellsTheUserOfWhatMatters) {
  EXPECT_EQ(depthCurveDifference(DepthCurve()), "");
  EXPECT_EQ(depthCurveDifference({{0.f, 0.0019f, -0.001f}}), "");
  EXPECT_NE(depthCurveDifference({{0.f, 0.001f, -0.0042f}}).find("up to 4.2 mm"), std::string::npos);
}

// A wall whose far part is set back by 4 cm is mapped as one plane: that is no error of the camera.
TEST(DepthCurveFit, SurfacesThatPassForOneAreNoErrorOfTheCamera) {
  SimulatedKeyframes world(3);
  world.setDepthCamera(exact, 0.004);
  Map map = mapAtTruePoses(&world, 60);
  int moved = 0;
  for (KeyframeId id = 1; id <= 60; ++id) {
    const auto seen = map.keyframe(id).planes.find(1);
    if (seen == map.keyframe(id).planes.end()) continue;
    for (PlaneSample& point : seen->second.points) {
      if (point.p_C.z() < 3) continue;
      point.p_C *= 1 + 0.04f / point.p_C.z();
      ++moved;
    }
  }
  ASSERT_GT(moved, 50);
  EXPECT_FALSE(fitDepthCurve(map, DepthNoise()));
}

// End to end: the back end estimates the curve, reports it, and applies it to all keyframes.
TEST(DepthCurveFit, WhatTheBackEndLearnsHoldsForAllKeyframes) {
  SimulatedKeyframes world(6);
  world.setDepthCamera(wiggle, 0.004);
  BackEndOptions options;
  options.lockstep = true;
  options.loop_closing = false;
  CheckedBackEnd back_end(options, world.sensor());
  MapUpdate update;
  std::set<LandmarkId> told;  // the landmarks known to a listener that receives all updates
  const auto hear = [&told, &update] {
    for (const LandmarkEstimate& landmark : update.landmarks) told.insert(landmark.id);
    for (const LandmarkId id : update.removed_landmarks) told.erase(id);
    for (const auto& [from, into] : update.merged_landmarks) told.erase(from);
  };
  int told_all = 0;
  for (int k = 0; k < 60; ++k) {
    update = back_end.addKeyframe(world.next());
    ASSERT_EQ(back_end.lastRefusal(), "");
    hear();
    back_end.applyPlaneUpdate(world.planes());
    told_all += update.global && !update.depth_curve.empty();
    if (!back_end.globalBaWanted() || k > 40) continue;  // leaves work for finish() as well
    update = back_end.merge(back_end.run(back_end.startGlobalBa()));
    hear();
  }
  update = back_end.finish();
  hear();
  const std::vector<LandmarkId> ids = back_end.map().landmarkIds();
  EXPECT_EQ(told, std::set<LandmarkId>(ids.begin(), ids.end()));
  EXPECT_GT(told_all, 0);
  EXPECT_LT(leftOver(update.depth_curve), 0.001);
  for (const auto& [id, kf] : back_end.map().keyframes()) {
    EXPECT_EQ(kf.data->frame.camera_correction.curve, update.depth_curve);
    for (const auto& [plane, o] : kf.planes) EXPECT_EQ(o.camera_correction.curve, update.depth_curve);
  }
  for (const KeyframeEstimate& estimate : update.keyframes) {
    EXPECT_EQ(estimate.camera_correction.curve, update.depth_curve);
  }
  back_end.reset();
  EXPECT_TRUE(back_end.addKeyframe(world.next()).depth_curve.empty());

  options.depth_curve = false;
  SimulatedKeyframes again(6);
  again.setDepthCamera(wiggle, 0.004);
  CheckedBackEnd believing(options, again.sensor());
  for (int k = 0; k < 60; ++k) {
    believing.addKeyframe(again.next());
    believing.applyPlaneUpdate(again.planes());
  }
  EXPECT_TRUE(believing.finish().depth_curve.empty());
}

}  // namespace
}  // namespace vip_slam
