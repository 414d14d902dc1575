// SPDX-License-Identifier: BSD-3-Clause
// The benchmark's simulation and runs: counts as requested, all variants build from one map, the adjustment helps.
#include <gtest/gtest.h>

#include <stdexcept>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_eval/gba_benchmark/gba_benchmark.h"

using namespace vip_slam;

namespace {

SimulatedMapOptions smallMap() {
  SimulatedMapOptions options;
  options.keyframes = 60;
  options.plane_points = 400;
  options.free_points = 150;
  options.keyframe_interval = 1.25;
  return options;
}

}  // namespace

TEST(GbaBenchmark, SimulationGivesWhatIsAskedFor) {
  const SimulatedMap map = simulateMap(smallMap());
  EXPECT_EQ(checkMap(map.map), "");
  EXPECT_EQ(map.map.keyframes().size(), 60u);
  EXPECT_EQ(map.map.landmarks().size(), 550u);
  SimulatedMapOptions too_many = smallMap();
  too_many.keyframes = 5;
  too_many.plane_points = 100000;
  EXPECT_THROW(simulateMap(too_many), std::invalid_argument);
  too_many = smallMap();
  too_many.world = "moon";
  EXPECT_THROW(simulateMap(too_many), std::invalid_argument);
}

TEST(GbaBenchmark, TableHasAllPlanes) {
  SimulatedMapOptions options;  // of the paper's Table III
  const SimulatedMap map = simulateMap(options);
  int vertical = 0, horizontal = 0;
  for (const auto& plane : map.map.planes()) {
    vertical += plane.second.estimate.kind == PlaneKind::kVertical;
    horizontal += plane.second.estimate.kind == PlaneKind::kHorizontal;
  }
  EXPECT_EQ(vertical, 10);
  EXPECT_EQ(horizontal, 6);
}

TEST(GbaBenchmark, BothSolversReachTheSameCostInAllVariants) {
  const SimulatedMap map = simulateMap(smallMap());
  for (const Variant v : {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip}) {
    const std::vector<GbaRun> runs = runGba(map, {{v, "structured"}, {v, "ceres"}}, 10, 1);
    const GbaRun &own = runs[0], &stock = runs[1];
    EXPECT_NEAR(own.summary.final_cost, stock.summary.final_cost, 1e-4 * stock.summary.final_cost) << variantName(v);
    EXPECT_LT(own.summary.final_cost, 0.5 * own.summary.initial_cost) << variantName(v);
  }
  // Compression changes nothing but the time.
  const std::vector<GbaRun> runs = runGba(map, {{Variant::kViP}, {Variant::kViCp}}, 10, 1);
  const GbaRun &p = runs[0], &cp = runs[1];
  EXPECT_NEAR(p.summary.final_cost, cp.summary.final_cost, 1e-5 * p.summary.final_cost);
  EXPECT_NEAR(p.rmse, cp.rmse, 1e-4);
}

TEST(GbaBenchmark, PrefixOfAMapIsAMap) {
  const SimulatedMap part = prefix(simulateMap(smallMap()), 25);
  EXPECT_EQ(part.map.keyframes().size(), 25u);
  EXPECT_EQ(checkMap(part.map), "");
}
