// SPDX-License-Identifier: BSD-3-Clause
// Depth of corners on rims and slanted walls, on exact scenes with known noise.
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "test_camera.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_frontend/tracking/feature_depth.h"

namespace vip_slam {
namespace {

constexpr double kLongFocal = 480;

DepthNoise depthNoise() {
  DepthNoise n;
  n.a = 0.001;
  n.b = 0.0017;
  return n;
}

cv::Mat renderDepth(const std::function<double(double, double)>& z, double scale, unsigned seed) {
  cv::Mat_<float> depth(480, 640);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double exact = z(u, v);
      depth(v, u) = static_cast<float>(exact + scale * depthNoise().sigma(exact) * normal(random));
    }
  }
  return depth;
}

/// A wall to the right, one metre from the camera's axis: z = f / (u - cx).
double sideWall(double u, double) { return u > kCx + 60 ? kLongFocal / (u - kCx) : 8.0; }

/// A wall 3 m ahead that ends at column 320 and leaves a recess behind it.
double rim(double u, double) { return u <= 320 ? 3.0 : 3.2; }

TEST(FeatureDepth, SmoothSurfacesAreAsBefore) {
  const cv::Mat depth = renderDepth([](double u, double v) { return 3.0 + 1e-4 * (u + v); }, 1.0, 1);
  for (int u = 20; u < 620; u += 13) {
    const FeatureDepth found = featureDepth(depth, u + 0.3, 200.4, depthNoise());
    EXPECT_EQ(found.source, FeatureDepth::Source::kSmooth);
    EXPECT_EQ(found.z, safeDepth(depth, u + 0.3, 200.4, depthNoise()));
    EXPECT_FLOAT_EQ(found.sigma, static_cast<float>(depthNoise().sigma(found.z)));
  }
}

TEST(FeatureDepth, FlatAnglesAreReadWithTheRightUncertainty) {
  const cv::Mat depth = renderDepth(sideWall, 1.0, 2);
  double sum2 = 0, sigma = 0;
  int refused = 0, count = 0;
  for (int u = 390; u < 420; ++u) {
    for (int v = 20; v < 460; v += 7) {
      refused += safeDepth(depth, u + 0.25, v, depthNoise()) == 0;
      const FeatureDepth found = featureDepth(depth, u + 0.25, v, depthNoise());
      if (found.source != FeatureDepth::Source::kSlanted) continue;
      const double error = (found.z - sideWall(u + 0.25, v)) / found.sigma;
      sum2 += error * error;
      sigma += found.sigma / found.z;
      ++count;
    }
  }
  ASSERT_GT(refused, 1000);  // for which the edge-safe look-up gives no depth
  EXPECT_GT(count, 0.9 * refused);
  EXPECT_LT(std::sqrt(sum2 / count), 1.0);  // sigma also covers half a pixel of corner error, absent here
  EXPECT_LT(sigma / count, 0.02);
}

TEST(FeatureDepth, RimsGiveTheNearSide) {
  const cv::Mat depth = renderDepth(rim, 1.0, 3);
  for (int v = 10; v < 470; v += 5) {
    for (const double u : {318.6, 319.5, 320.0, 320.7, 321.4}) {
      const FeatureDepth found = featureDepth(depth, u, v, depthNoise());
      ASSERT_EQ(found.source, FeatureDepth::Source::kRim) << u << " " << v;
      EXPECT_NEAR(found.z, 3.0, 0.015);
    }
    // Two pixels beyond the rim the corner may belong to the background: no depth; further away, the background's.
    EXPECT_EQ(featureDepth(depth, 322.0, v, depthNoise()).z, 0.0f);
    EXPECT_NEAR(featureDepth(depth, 324.0, v, depthNoise()).z, 3.2, 0.02);
  }
}

TEST(FeatureDepth, RimOfASlantedWallIsExtrapolatedOnItsPlane) {
  // The side wall ends at column 440 (a doorway); behind it is another room.
  const auto scene = [](double u, double v) { return u >= 440 ? sideWall(u, v) : 9.0; };
  const cv::Mat depth = renderDepth(scene, 1.0, 4);
  int found_rim = 0;
  double sum2 = 0;
  for (int v = 10; v < 470; v += 5) {
    const FeatureDepth found = featureDepth(depth, 439.6, v, depthNoise());
    if (found.source != FeatureDepth::Source::kRim) continue;
    ++found_rim;
    sum2 += std::pow((found.z - kLongFocal / (439.6 - kCx)) / found.sigma, 2);
  }
  EXPECT_GT(found_rim, 80);
  EXPECT_LT(std::sqrt(sum2 / found_rim), 1.2);
}

TEST(FeatureDepth, ARoughMessGivesNothing) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> z(2.0f, 4.0f);
  cv::Mat_<float> depth(480, 640);
  for (float& value : depth) value = z(random);
  int found = 0;
  for (int u = 10; u < 630; u += 5) found += featureDepth(depth, u, 240, depthNoise()).z > 0;
  EXPECT_LE(found, 1);
}

TEST(FeatureDepth, HolesAndTheImageBorderAreSurvived) {
  cv::Mat depth = renderDepth(rim, 0.0, 6);
  depth.colRange(317, 324).setTo(0);
  EXPECT_EQ(featureDepth(depth, 320, 100, depthNoise()).z, 0.0f);
  depth.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(featureDepth(depth, 320, 100, depthNoise()).z, 0.0f);
  EXPECT_EQ(featureDepth(cv::Mat(), 320, 100, depthNoise()).z, 0.0f);
  depth = renderDepth(rim, 0.0, 7);
  for (const double u : {-3.0, -0.4, 0.0, 639.0, 639.4, 645.0}) {
    const FeatureDepth found = featureDepth(depth, u, 0.0, depthNoise());
    EXPECT_TRUE(std::isfinite(found.z));
  }
  EXPECT_EQ(featureDepth(depth, std::numeric_limits<double>::quiet_NaN(), 5, depthNoise()).z, 0.0f);
}

}  // namespace
}  // namespace vip_slam
