// SPDX-License-Identifier: BSD-3-Clause
// What is added to depth readings at each distance.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "vip_slam_core/depth/depth_curve.h"

namespace vip_slam {
namespace {

DepthCurve wave(float amplitude, float frequency) {
  DepthCurve curve;
  for (int k = 0; k <= 40; ++k) curve.added.push_back(amplitude * std::sin(frequency * float(DepthCurve::kStep * k)));
  return curve;
}

TEST(DepthCurve, IsLinearBetweenItsEntriesAndConstantBeyond) {
  const DepthCurve curve{{0.0f, 0.002f, -0.004f}};
  EXPECT_FLOAT_EQ(curve.at(0.125f), 0.002f);
  EXPECT_FLOAT_EQ(curve.at(0.0625f), 0.001f);
  EXPECT_NEAR(curve.at(0.15625f), 0.0005f, 1e-8f);
  EXPECT_FLOAT_EQ(curve.at(0.25f), -0.004f);
  EXPECT_FLOAT_EQ(curve.at(7.0f), -0.004f);
  EXPECT_FLOAT_EQ(curve.at(-1.0f), 0.0f);
  EXPECT_EQ(curve.at(std::numeric_limits<float>::quiet_NaN()), 0.0f);
  EXPECT_EQ(DepthCurve().at(2.0f), 0.0f);
}

TEST(DepthCurve, OneAfterTheOtherAddsBoth) {
  const DepthCurve first = wave(0.004f, 4.1f), then = wave(0.003f, 1.3f);
  const DepthCurve both = chained(first, then);
  for (float z = 0.125f; z < 5; z += 0.125f) {
    const float once = z + first.at(z);
    EXPECT_NEAR(z + both.at(z), once + then.at(once), 1e-6f);
  }
  EXPECT_EQ(chained(first, DepthCurve()), first);
  EXPECT_EQ(chained(DepthCurve(), then), then);
}

TEST(DepthCurve, MovesAnImagesReadingsAndNothingElse) {
  const DepthCurve curve = wave(0.004f, 4.1f);
  cv::Mat depth = (cv::Mat_<float>(1, 5) << 0.f, 1.5f, 0.0005f, std::numeric_limits<float>::quiet_NaN(), 9.f);
  const cv::Mat before = depth.clone();
  applyDepthCurve(curve, &depth);
  EXPECT_EQ(depth.at<float>(0), 0.f);
  EXPECT_FLOAT_EQ(depth.at<float>(1), 1.5f + curve.at(1.5f));
  EXPECT_GT(depth.at<float>(2), 0.f);
  EXPECT_TRUE(std::isnan(depth.at<float>(3)));
  EXPECT_FLOAT_EQ(depth.at<float>(4), 9.f + curve.added.back());
  cv::Mat same = before.clone();
  applyDepthCurve(DepthCurve(), &same);
  EXPECT_EQ(same.at<float>(1), before.at<float>(1));
}

TEST(DepthCurve, WhatNoCameraReadsIsRefused) {
  EXPECT_EQ(validateDepthCurve(wave(0.01f, 4.1f)), "");
  EXPECT_EQ(validateDepthCurve(DepthCurve()), "");
  EXPECT_EQ(validateDepthCurve({{0.f, std::nanf(""), 0.f}}), "nan m are added at 0.125 m, expected at most 1");
  EXPECT_EQ(validateDepthCurve({{0.f, 0.f, 1.5f}}), "1.5 m are added at 0.25 m, expected at most 1");
  EXPECT_EQ(validateDepthCurve({{0.f, 0.f, -0.1f}}),
            "falls by 0.1 m up to 0.25 m, expected at most 0.0625 from entry to entry");
}

}  // namespace
}  // namespace vip_slam
