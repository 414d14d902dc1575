// SPDX-License-Identifier: BSD-3-Clause
// Whether the map detects pixel errors larger than their reported sigma.
#include <gtest/gtest.h>

#include "../../src/optimisation/track_noise.h"
#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/map/landmark_maker.h"
#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_backend/solver/ba_solver.h"

using namespace vip_slam;

namespace {

/// The tracks' noise is 0.1 px, as reported; `shift`: sigma (px) of an additional error along the row, common to all
/// views of a keyframe, as when the image was taken at another time than the pose.
struct Adjusted {
  Map map;
  BuiltProblem built;  ///< at the adjusted map's estimate
};

Adjusted adjustedMap(double shift, int keyframes) {
  SimulatedKeyframes world(3);
  Adjusted result;
  LandmarkMaker maker{500.0};
  BuilderSettings settings;
  settings.focal = world.sensor().camera.fx;
  for (int k = 0; k < keyframes; ++k) {
    auto kf = std::make_shared<Keyframe>(*world.next());
    // A shift that depends on the depth, which no rotation of the camera can absorb.
    const double off = world.gauss(shift);
    for (Feature& f : kf->frame.features) f.xy.x() += static_cast<float>((f.depth > 2.5 ? off : -off) / settings.focal);
    result.map.addKeyframe(kf, world.truth(kf->frame.t), ImuNoise());
    maker.process(kf->id, &result.map);
    EXPECT_EQ(checkMap(result.map), "") << kf->id;
  }
  for (int round = 0; round < 2; ++round) {
    BuiltProblem problem = buildProblem(result.map, globalScope(result.map), settings);
    makeSolver("structured")->solve(problem.problem, SolverOptions());
    storeProblem(problem, ImuNoise(), &result.map);
    EXPECT_EQ(checkMap(result.map), "") << "round " << round;
  }
  result.built = buildProblem(result.map, globalScope(result.map), settings);
  return result;
}

double largestWeight(const BuiltProblem& built) {
  double largest = 0;
  for (const BaObservation& o : built.problem.observations) largest = std::max(largest, o.weight);
  return largest;
}

}  // namespace

TEST(TrackNoise, NoiseAsToldIsBelieved) {
  const Adjusted exact = adjustedMap(0, 12);
  EXPECT_EQ(exact.built.track_noise_factor, 1);
  EXPECT_NEAR(largestWeight(exact.built), 460 / 0.1, 1);
}

TEST(TrackNoise, ALandmarkThatOtherTracksPullAsideIsNoNoiseOfThisOne) {
  Adjusted pulled = adjustedMap(0, 12);
  SimulatedKeyframes world(3);
  for (const LandmarkId id : pulled.map.landmarkIds()) {
    const Eigen::Vector3d aside(world.gauss(0.004), world.gauss(0.004), world.gauss(0.004));  // most of a pixel
    pulled.map.setPosition(id, pulled.map.landmark(id).p_W + aside);
  }
  BuilderSettings settings;
  settings.focal = world.sensor().camera.fx;
  EXPECT_EQ(buildProblem(pulled.map, globalScope(pulled.map), settings).track_noise_factor, 1);
}

TEST(TrackNoise, WhatTheMapContradictsWeighsLess) {
  // 0.5 px in one of two directions, in addition to 0.1 px in both: sqrt((0.1^2 + 0.1^2 + 0.5^2) / (0.1^2 + 0.1^2)) =
  // 3.7, less what the adjustment absorbs in the poses.
  const Adjusted off = adjustedMap(0.5, 12);
  EXPECT_GT(off.built.track_noise_factor, 2.2);
  EXPECT_LT(off.built.track_noise_factor, 4.5);
  EXPECT_NEAR(largestWeight(off.built), 460 / (0.1 * off.built.track_noise_factor), 1);
}

TEST(TrackNoise, TooFewViewsSayNothing) { EXPECT_EQ(adjustedMap(0.5, 4).built.track_noise_factor, 1); }

TEST(TrackNoise, TheUserIsTold) {
  EXPECT_EQ(trackNoiseDifference(1), "");
  EXPECT_NE(trackNoiseDifference(3.26).find("by 3.3 times what their noise explains"), std::string::npos);
}
