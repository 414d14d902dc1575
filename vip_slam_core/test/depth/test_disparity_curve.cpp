// SPDX-License-Identifier: BSD-3-Clause
// Depth from disparities with a constant error.
#include <gtest/gtest.h>

#include <cmath>

#include "vip_slam_core/depth/disparity_curve.h"

namespace vip_slam {
namespace {

// A stereo camera with 600 px focal length and 5 cm baseline whose disparities are 0.1 px too large.
constexpr double kFocalBaseline = 30.0, kTooLarge = 0.1;

TEST(DisparityCurve, TakesBackWhatTheDisparityHasTooMuch) {
  const double error = kTooLarge / kFocalBaseline;
  for (const double z : {0.3, 1.0, 2.5, 6.0, 10.0}) {
    const double reading = kFocalBaseline / (kFocalBaseline / z + kTooLarge);
    EXPECT_NEAR(reading + addedForDisparity(error, reading), z, 1e-9);
    EXPECT_NEAR(reading + disparityCurve(error, 10).at(static_cast<float>(reading)), z, 2e-4);
  }
  EXPECT_EQ(addedForDisparity(0, 3), 0.0);
}

TEST(DisparityCurve, TwoErrorsAddUp) {
  const DepthCurve both = chained(disparityCurve(0.002, 8), disparityCurve(-0.0005, 8));
  for (const float z : {0.5f, 2.f, 5.f}) EXPECT_NEAR(both.at(z), disparityCurve(0.0015, 8).at(z), 1e-4);
}

TEST(DisparityCurve, IsOneThatACurveMayBe) {
  for (const double error : {-0.05, -0.002, 0.002, 0.05, 0.3}) {
    const DepthCurve curve = disparityCurve(error, 12);
    EXPECT_EQ(validateDepthCurve(curve), "") << error;
    EXPECT_GE(double(curve.added.size() - 1) * DepthCurve::kStep, 12.0);
    EXPECT_EQ(curve.at(0.f), 0.f);
  }
}

TEST(DisparityCurve, AnOffsetIsVoidFromAMillimetreAtTwoMetresOn) {
  EXPECT_FALSE(voidsDepthOffset(0.0002));
  EXPECT_TRUE(voidsDepthOffset(0.0003));
  EXPECT_TRUE(voidsDepthOffset(-0.0003));
}

TEST(DisparityCurve, IsOfCamerasThatMeasureDisparities) {
  EXPECT_TRUE(measuresDisparity(DepthSensorType::kStereo));
  EXPECT_TRUE(measuresDisparity(DepthSensorType::kStructuredLight));
  EXPECT_FALSE(measuresDisparity(DepthSensorType::kTof));
  EXPECT_FALSE(measuresDisparity(DepthSensorType::kProportional));
}

TEST(DepthNoise, IsUnbiasedUpToThreeSigmasBeforeTheRangesEnd) {
  DepthNoise noise = DepthNoise::preset(DepthSensorType::kStereo);
  noise.a = 0.001, noise.b = 0, noise.c = 0.0035, noise.max_range = 6;
  EXPECT_NEAR(noise.unbiasedRange(), 6 - 3 * 0.127, 1e-9);
}

}  // namespace
}  // namespace vip_slam
