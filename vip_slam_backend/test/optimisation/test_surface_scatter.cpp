// SPDX-License-Identifier: BSD-3-Clause
// How far landmarks lie beside their planes, and which of them homographies may use.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../src/optimisation/surface_scatter.h"
#include "optimisation/wall.h"

using namespace vip_slam;
using backend::OffPlane;
using backend::surfaceVariance;

namespace {

constexpr double kPrior = 0.006 * 0.006;

/// Points of a surface with this scatter, m; their views tell their distances to 1 to 9 mm.
std::vector<OffPlane> points(int count, double scatter, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> sigma(0.001, 0.009);
  std::vector<OffPlane> points;
  for (int k = 0; k < count; ++k) {
    const double own = sigma(random);
    points.push_back({normal(random) * std::hypot(own, scatter), own * own});
  }
  return points;
}

double meanOfSeeds(int count, double scatter, double prior = kPrior) {
  double sum = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) sum += surfaceVariance(points(count, scatter, seed), prior) / 20;
  return std::sqrt(sum);
}

/// Moves each landmark of the wall along its normal, and its views with it.
void standOff(Wall* wall, const std::function<double(int)>& distance) {
  for (int k = 0; k < Wall::kKeyframes; ++k) {
    auto data = std::make_shared<Keyframe>(*wall->map.keyframe(k + 1).data);
    for (int l = 0; l < Wall::kLandmarks; ++l) {
      const Eigen::Vector3d p =
          wall->map.keyframe(k + 1).T_W_C().inverse() * (Wall::point(l) - Eigen::Vector3d(0, 0, distance(l)));
      data->frame.features[l].xy = p.hnormalized().cast<float>();
    }
    wall->map.keyframe(k + 1).data = data;
  }
}

}  // namespace

TEST(SurfaceScatter, IsFoundWhateverWasAssumed) {
  EXPECT_NEAR(meanOfSeeds(200, 0.005), 0.005, 0.0005);
  EXPECT_NEAR(meanOfSeeds(200, 0.015), 0.015, 0.0015);
  EXPECT_NEAR(meanOfSeeds(200, 0.005, 1e-8), 0.005, 0.0005);
}

TEST(SurfaceScatter, OfAFlatSurfaceIsBelowItsPointsNoise) { EXPECT_LT(meanOfSeeds(1000, 0), 0.002); }

TEST(SurfaceScatter, FewPointsLeaveWhatWasAssumed) {
  EXPECT_NEAR(surfaceVariance({}, kPrior), kPrior, 0.02 * kPrior);
  EXPECT_GT(meanOfSeeds(2, 0), 0.004);
}

TEST(SurfaceScatter, OutliersAreCutOff) {
  std::vector<OffPlane> all = points(200, 0.005, 1);
  const double without = surfaceVariance(all, kPrior);
  for (int k = 0; k < 10; ++k) all[20 * k].distance = 0.08;
  EXPECT_LT(surfaceVariance(all, kPrior), 3 * without);  // 13 times if they counted
}

// A bowed wall: its points are 8 mm before or behind it.
TEST(SurfaceScatter, PointsOffThePlaneKeepLandmarksOfTheirOwn) {
  Wall wall;
  wall.settings.measure_surfaces = true;
  standOff(&wall, [](int l) { return l % 2 == 0 ? 0.008 : -0.008; });
  const BuiltProblem built = buildProblem(wall.map, globalScope(wall.map), wall.settings);
  ASSERT_EQ(built.surface_variances.size(), 1u);
  EXPECT_NEAR(std::sqrt(built.surface_variances[0]), 0.008, 0.002);
  EXPECT_EQ(built.problem.homographies.size(), 0u);
  EXPECT_EQ(built.points.size(), std::size_t(Wall::kLandmarks));
  // A larger map takes what the window found.
  storeProblem(built, ImuNoise(), &wall.map);
  wall.settings.measure_surfaces = false;
  EXPECT_EQ(wall.pairs(true), 0);
}

// Views from one place tell nothing of the distance, and a homography does no harm.
TEST(SurfaceScatter, WithoutParallaxThePlaneIsUsed) {
  Wall wall;
  wall.settings.measurement.surface_sigma = 0.006;
  EXPECT_EQ(wall.pairs(true), 0);
  for (int k = 0; k < Wall::kKeyframes; ++k) wall.lookFrom(k, SE3());
  EXPECT_EQ(wall.pairs(true), Wall::kLandmarks * (Wall::kKeyframes - 1));
}
