// SPDX-License-Identifier: BSD-3-Clause
// The paper's Table III: what each variant's problem contains at the table's size, that planes make the trajectory no
// worse, and that problems grow with a corridor's length and no faster.
#include <gtest/gtest.h>

#include <string>

#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_eval/gba_benchmark/gba_benchmark.h"

using namespace vip_slam;

namespace {

// The table of the paper.
constexpr std::size_t kKeyframes = 215, kPlanePoints = 2236, kFreePoints = 2032, kPlanes = 16;
constexpr std::size_t kPoints = kPlanePoints + kFreePoints;

const SimulatedMap& tableMap() {
  static const SimulatedMap map = simulateMap(SimulatedMapOptions());
  return map;
}

BuiltProblem built(Variant variant) {
  BuilderSettings settings;
  settings.variant = variant;
  settings.focal = tableMap().focal;
  settings.measurement.pixel_sigma = tableMap().pixel_sigma;
  settings.measurement.huber = settings.measurement.depth_huber = 0;
  settings.measurement.outlier_chi2 = 1e6;
  return buildProblem(tableMap().map, globalScope(tableMap().map), settings);
}

// The benchmark's problem without any iteration.
GbaRun unsolved(const SimulatedMap& map, Variant variant) {
  return runGba(map, {{variant, "structured"}}, 0, 1).front();
}

template <class Factors>
std::size_t pairsIn(const Factors& factors) {
  std::size_t sum = 0;
  for (const auto& f : factors) sum += f.pairs;
  return sum;
}

template <class Factors>
std::size_t pointsIn(const Factors& factors) {
  std::size_t sum = 0;
  for (const auto& f : factors) sum += f.points;
  return sum;
}

SimulatedMap corridor(int keyframes) {
  SimulatedMapOptions options;
  options.world = "corridor";
  options.keyframes = keyframes;
  options.plane_points = 10 * keyframes;
  options.free_points = 6 * keyframes;
  return simulateMap(options);
}

}  // namespace

TEST(GbaVariants, TheDefaultMapHasTheTablesSize) {
  const Map& map = tableMap().map;
  EXPECT_EQ(map.keyframes().size(), kKeyframes);
  EXPECT_EQ(map.landmarks().size(), kPoints);
  EXPECT_EQ(map.planes().size(), kPlanes);
  std::size_t on_planes = 0;
  for (const auto& landmark : map.landmarks()) on_planes += landmark.second.plane != 0;
  EXPECT_EQ(on_planes, kPlanePoints);
}

TEST(GbaVariants, ViHasPointsOnly) {
  const BaProblem problem = built(Variant::kVi).problem;
  EXPECT_EQ(problem.points.size(), kPoints);
  EXPECT_EQ(problem.observations.size(), tableMap().plane_observations + tableMap().free_observations);
  EXPECT_EQ(problem.imu.size(), kKeyframes - 1);
  EXPECT_TRUE(problem.planes.empty());
  EXPECT_TRUE(problem.homographies.empty() && problem.homography_pairs.empty());
  EXPECT_TRUE(problem.point_to_plane.empty() && problem.plane_samples.empty());
  EXPECT_EQ(problem.parameters(), 15 * kKeyframes + 3 * kPoints);
}

TEST(GbaVariants, ViPHasPairsAndSamplesOneByOneAndAllPoints) {
  const BaProblem problem = built(Variant::kViP).problem;
  EXPECT_EQ(problem.points.size(), kPoints);
  EXPECT_EQ(problem.planes.size(), kPlanes);
  EXPECT_TRUE(problem.homographies.empty() && problem.point_to_plane.empty());
  // A pair for every view of a plane point but the host's.
  EXPECT_EQ(problem.homography_pairs.size(), tableMap().plane_observations - kPlanePoints);
  EXPECT_GT(problem.plane_samples.size(), 20 * kKeyframes);
  EXPECT_EQ(problem.parameters(), 15 * kKeyframes + 3 * (kPoints + kPlanes));
}

TEST(GbaVariants, ViCpHasTheSameCompressed) {
  const BaProblem one_by_one = built(Variant::kViP).problem, problem = built(Variant::kViCp).problem;
  EXPECT_EQ(problem.points.size(), kPoints);
  EXPECT_EQ(problem.planes.size(), kPlanes);
  EXPECT_TRUE(problem.homography_pairs.empty() && problem.plane_samples.empty());
  EXPECT_EQ(pairsIn(problem.homographies), one_by_one.homography_pairs.size());
  EXPECT_EQ(pointsIn(problem.point_to_plane), one_by_one.plane_samples.size());
  EXPECT_LT(10 * problem.homographies.size(), one_by_one.homography_pairs.size());
  EXPECT_LT(10 * problem.point_to_plane.size(), one_by_one.plane_samples.size());
  EXPECT_EQ(problem.parameters(), one_by_one.parameters());
}

TEST(GbaVariants, VipLeavesOutThePlanePoints) {
  const BaProblem with = built(Variant::kViCp).problem;
  const BuiltProblem without = built(Variant::kVip);
  const BaProblem& problem = without.problem;
  EXPECT_EQ(problem.points.size(), kFreePoints);
  EXPECT_EQ(without.plane_points.size(), kPlanePoints);
  EXPECT_EQ(problem.observations.size(), tableMap().free_observations);
  EXPECT_EQ(problem.planes.size(), kPlanes);
  EXPECT_TRUE(problem.homography_pairs.empty() && problem.plane_samples.empty());
  EXPECT_EQ(problem.homographies.size(), with.homographies.size());
  EXPECT_EQ(pairsIn(problem.homographies), pairsIn(with.homographies));
  EXPECT_EQ(problem.point_to_plane.size(), with.point_to_plane.size());
  EXPECT_EQ(problem.parameters(), with.parameters() - 3 * kPlanePoints);
  EXPECT_EQ(problem.residualBlocks(), with.residualBlocks() - tableMap().plane_observations);
}

// The benchmark's own problems are these.
TEST(GbaVariants, TheBenchmarkRunsThem) {
  for (const Variant variant : {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip}) {
    const BaProblem problem = built(variant).problem;
    const GbaRun run = unsolved(tableMap(), variant);
    EXPECT_EQ(run.keyframes, static_cast<int>(kKeyframes)) << variantName(variant);
    EXPECT_EQ(run.points, problem.points.size()) << variantName(variant);
    EXPECT_EQ(run.planes, problem.planes.size()) << variantName(variant);
    EXPECT_EQ(run.homographies, problem.homographies.size()) << variantName(variant);
    EXPECT_EQ(run.homography_pairs, problem.homography_pairs.size()) << variantName(variant);
    EXPECT_EQ(run.point_to_plane, problem.point_to_plane.size() + problem.plane_samples.size()) << variantName(variant);
    EXPECT_EQ(run.summary.residual_blocks, problem.residualBlocks()) << variantName(variant);
    EXPECT_EQ(run.summary.parameters, problem.parameters()) << variantName(variant);
  }
}

TEST(GbaVariants, VipIsNoLessAccurateThanVi) {
  for (const unsigned seed : {1, 2, 3}) {
    SimulatedMapOptions options;
    options.seed = seed;
    const std::vector<GbaRun> runs = runGba(simulateMap(options), {{Variant::kVi}, {Variant::kVip}}, 10, 1);
    EXPECT_LE(runs[1].rmse, runs[0].rmse) << seed;
    EXPECT_LT(runs[1].rmse, 0.5 * runs[1].rmse_before) << seed;
  }
}

// Twice the length, and little more than twice the factors and the work per iteration.
TEST(GbaVariants, ProblemsGrowWithTheCorridor) {
  constexpr double kMost = 2.3;
  const SimulatedMap half = corridor(200), whole = corridor(400);
  for (const Variant variant : {Variant::kVi, Variant::kViCp, Variant::kVip}) {
    const GbaRun a = unsolved(half, variant), b = unsolved(whole, variant);
    const std::string name = variantName(variant);
    EXPECT_EQ(b.keyframes, 2 * a.keyframes) << name;
    EXPECT_LT(b.summary.residual_blocks, kMost * a.summary.residual_blocks) << name;
    EXPECT_LT(b.summary.parameters, kMost * a.summary.parameters) << name;
    EXPECT_GT(a.summary.factor_size, 0u) << name;
    EXPECT_LT(b.summary.factor_size, kMost * a.summary.factor_size) << name;
    if (variant == Variant::kVi) continue;
    EXPECT_GT(a.homographies, 0u) << name;
    EXPECT_LT(b.homographies, kMost * a.homographies) << name;
    EXPECT_LT(b.point_to_plane, kMost * a.point_to_plane) << name;
  }
}
