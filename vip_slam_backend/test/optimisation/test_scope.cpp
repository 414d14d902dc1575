// SPDX-License-Identifier: BSD-3-Clause
// What the local adjustment may move, what holds it, and the limits on iterations and time of both adjustments.
#include <gtest/gtest.h>

#include <algorithm>

#include "optimisation/odometry_map.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/optimisation/global_ba.h"

using namespace vip_slam;

namespace {

constexpr int kChain = 60;
constexpr double kNoTime = 1e-9;  // s

// Keyframe k of the older ones shares (7 k) % 11 landmarks with the window: none, or up to ten.
int sharedBy(KeyframeId k) { return static_cast<int>(7 * k % 11); }

// Keyframes in a chain. The landmarks that older ones share with the newest `window` are seen by one to all of these.
Map chain(int window) {
  Map map;
  const KeyframeId oldest_free = kChain - window + 1;
  int most = 0;
  for (KeyframeId k = 1; k < oldest_free; ++k) most += sharedBy(k);
  for (KeyframeId k = 1; k <= kChain; ++k) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = k;
    keyframe->previous = k - 1;
    keyframe->frame.t = keyframe->frame.state.t = 0.5 * static_cast<double>(k);
    keyframe->frame.features.resize(k < oldest_free ? sharedBy(k) : most);
    map.addKeyframe(keyframe, keyframe->frame.state, ImuNoise());
  }
  LandmarkId landmark = 0;
  for (KeyframeId k = 1; k < oldest_free; ++k)
    for (int n = 0; n < sharedBy(k); ++n, ++landmark) {
      map.addLandmark(landmark, Eigen::Vector3d(0, 0, 3), {k, static_cast<std::uint32_t>(n)});
      for (KeyframeId f = oldest_free; f <= kChain - landmark % window; ++f)
        map.addObservation(landmark, {f, static_cast<std::uint32_t>(landmark)});
    }
  return map;
}

std::vector<KeyframeId> range(KeyframeId first, KeyframeId last) {
  std::vector<KeyframeId> ids;
  for (KeyframeId id = first; id <= last; ++id) ids.push_back(id);
  return ids;
}

BuilderSettings builderSettings(const SimulatedKeyframes& world) {
  BuilderSettings settings;
  settings.focal = world.sensor().camera.fx;
  return settings;
}

GlobalBaProblem globalProblem(const Map& map, const SimulatedKeyframes& world, const char* solver) {
  GlobalBaProblem job;
  job.map = std::make_shared<const Map>(map);
  job.settings = builderSettings(world);
  job.solver = solver;
  return job;
}

std::size_t observationsOf(const Map& map) {
  std::size_t sum = 0;
  for (const auto& landmark : map.landmarks()) sum += landmark.second.observations.size();
  return sum;
}

}  // namespace

TEST(Scope, NewestKeyframesAreFreeAndTheirLandmarksObserversFixed) {
  const LocalBaOptions options;
  const Map map = chain(options.window);
  ASSERT_EQ(checkMap(map), "");
  const ProblemScope scope = localScope(map, options);
  EXPECT_EQ(options.window, 20);
  EXPECT_EQ(scope.free, range(41, 60));
  std::vector<KeyframeId> observers;
  for (KeyframeId k = 1; k <= 40; ++k)
    if (sharedBy(k) > 0 || k == 40) observers.push_back(k);
  EXPECT_EQ(scope.fixed, observers);
}

TEST(Scope, OfManyObserversThoseThatShareMostAreFixed) {
  LocalBaOptions options;
  const Map map = chain(options.window);
  for (const int most : {0, 1, 7, 12}) {
    options.max_fixed_keyframes = most;
    std::vector<KeyframeId> ranked = range(1, 40);
    std::sort(ranked.begin(), ranked.end(), [](KeyframeId a, KeyframeId b) {
      return sharedBy(a) != sharedBy(b) ? sharedBy(a) > sharedBy(b) : a > b;  // the newer of equals
    });
    ranked.resize(most);
    // The keyframe before the window is the other end of an IMU factor and does not count.
    if (!std::count(ranked.begin(), ranked.end(), 40)) ranked.push_back(40);
    std::sort(ranked.begin(), ranked.end());
    EXPECT_EQ(localScope(map, options).fixed, ranked) << most;
  }
}

TEST(Scope, TheWindowCountsKeyframesNotIds) {
  LocalBaOptions options;
  options.max_fixed_keyframes = 0;
  Map map = chain(options.window);
  for (const KeyframeId culled : {40, 45, 50}) map.removeKeyframe(culled, ImuNoise(), 3.0);
  const ProblemScope scope = localScope(map, options);
  EXPECT_EQ(scope.free.size(), 20u);
  EXPECT_EQ(scope.free.front(), 38u);
  EXPECT_EQ(scope.fixed, std::vector<KeyframeId>{37});  // the chain skips what was culled
  EXPECT_EQ(globalScope(map).free.size(), 57u);
  EXPECT_TRUE(globalScope(map).fixed.empty());
}

TEST(Scope, FixedKeyframesDoNotMoveToTheLastBit) {
  SimulatedKeyframes world(2);
  const Map map = mapOfOdometry(&world, kChain);
  const ProblemScope scope = localScope(map, LocalBaOptions());
  ASSERT_FALSE(scope.fixed.empty());
  for (const char* solver : {"structured", "ceres"}) {
    Map solved = map;
    BuiltProblem built = buildProblem(map, scope, builderSettings(world));
    EXPECT_TRUE(built.problem.gauges.empty());
    const SolverSummary summary = makeSolver(solver)->solve(built.problem, SolverOptions());
    ASSERT_TRUE(summary.usable) << solver;
    EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost) << solver;
    storeProblem(built, ImuNoise(), &solved);
    EXPECT_EQ(checkMap(solved), "");
    for (const auto& entry : map.keyframes()) {
      const bool free = std::count(scope.free.begin(), scope.free.end(), entry.first) > 0;
      const NavState &before = entry.second.state, &after = solved.keyframe(entry.first).state;
      EXPECT_EQ(before.T_W_I.matrix() != after.T_W_I.matrix(), free) << solver << ' ' << entry.first;
      EXPECT_EQ(before.v_W != after.v_W, free) << solver << ' ' << entry.first;
      EXPECT_EQ(before.bias_gyro != after.bias_gyro, free) << solver << ' ' << entry.first;
      EXPECT_EQ(before.bias_accel != after.bias_accel, free) << solver << ' ' << entry.first;
    }
  }
}

TEST(Limits, IterationsOfTheLocalAdjustment) {
  SimulatedKeyframes world(2);
  const Map map = mapOfOdometry(&world, kChain);
  const BuiltProblem start = buildProblem(map, localScope(map, LocalBaOptions()), builderSettings(world));
  for (const char* solver : {"structured", "ceres"})
    for (const int most : {1, 2, 4}) {
      BaProblem problem = start.problem;
      SolverOptions options;
      options.max_iterations = most;
      options.keep_iterating = true;
      const SolverSummary summary = makeSolver(solver)->solve(problem, options);
      EXPECT_EQ(summary.iterations, most) << solver;
      EXPECT_EQ(summary.log.size(), static_cast<std::size_t>(most)) << solver;
    }
}

// However much time there is: the map stays valid and the cost does not rise.
TEST(Limits, TimeOfTheLocalAdjustment) {
  SimulatedKeyframes world(2);
  const Map map = mapOfOdometry(&world, kChain);
  const BuiltProblem start = buildProblem(map, localScope(map, LocalBaOptions()), builderSettings(world));
  const double before = evaluateCost(start.problem);
  for (const char* solver : {"structured", "ceres"})
    for (const double seconds : {kNoTime, 1e-3, 3e-3, 1e-2}) {
      BuiltProblem built = start;
      SolverOptions options;
      options.max_iterations = 1000;
      options.keep_iterating = true;
      options.max_seconds = seconds;
      const SolverSummary summary = makeSolver(solver)->solve(built.problem, options);
      EXPECT_TRUE(summary.usable) << solver;
      EXPECT_LT(summary.iterations, 1000) << solver << ' ' << seconds;
      EXPECT_LE(evaluateCost(built.problem), before * (1 + 1e-12)) << solver << ' ' << seconds;
      Map solved = map;
      storeProblem(built, ImuNoise(), &solved);
      EXPECT_EQ(checkMap(solved), "") << solver << ' ' << seconds;
      if (seconds > kNoTime) continue;
      EXPECT_EQ(summary.iterations, 0) << solver;
      EXPECT_NE(summary.message.find(solver == std::string("ceres") ? "time reached" : "time used up"),
                std::string::npos)
          << summary.message;
    }
}

TEST(Limits, TimeOfTheGlobalAdjustment) {
  SimulatedKeyframes world(2);
  const Map map = mapOfOdometry(&world, kChain);
  const double odometry = positionError(map, world);
  for (const char* solver : {"structured", "ceres"})
    for (const double seconds : {kNoTime, 1e-2, 0.0}) {
      GlobalBaProblem job = globalProblem(map, world, solver);
      job.max_seconds = seconds;
      const GlobalBaSolution solution = solveGlobalBa(job);
      ASSERT_TRUE(solution.summary.usable) << solver;
      EXPECT_LE(solution.summary.final_cost, solution.summary.initial_cost) << solver << ' ' << seconds;
      if (seconds == kNoTime) EXPECT_EQ(solution.summary.iterations, 0) << solver;
      if (seconds == kNoTime && solver == std::string("structured"))
        EXPECT_EQ(solution.summary.message, "time used up");
      Map merged = map;
      mergeGlobalBa(solution, job.noise, &merged);
      EXPECT_EQ(checkMap(merged), "") << solver << ' ' << seconds;
      EXPECT_LT(positionError(merged, world), odometry * (1 + 1e-9)) << solver << ' ' << seconds;
      // All views are good, though a fifth of them looks wrong at the odometry's poses.
      EXPECT_GT(observationsOf(merged), 0.99 * observationsOf(map)) << solver << ' ' << seconds;
    }
}
