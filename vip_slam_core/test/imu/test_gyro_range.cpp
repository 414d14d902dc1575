// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/gyro_range.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace vip_slam {
namespace {

constexpr double kInterval = 0.005;

Eigen::Vector3d swing(double t) { return {0.3, -5.0 * std::sin(4.0 * t), 0.1 * std::cos(t)}; }

TEST(GyroRange, FindsTheEndThatSamplesStopAt) {
  GyroRange range;
  int cut = 0;
  for (int k = 0; k < 800; ++k) {
    Eigen::Vector3d rate = swing(k * kInterval);
    cut += std::abs(rate.y()) > 3.49;
    rate.y() = std::clamp(rate.y(), -3.49, 3.49);
    range.add(k * kInterval, rate);
  }
  EXPECT_GT(range.samples(), static_cast<std::uint64_t>(cut * 3 / 4));
  EXPECT_LE(range.samples(), static_cast<std::uint64_t>(cut));
  EXPECT_DOUBLE_EQ(range.end(), 3.49);
  // The last swing: fastest at 3.53 s, slow at 3.9 s.
  EXPECT_DOUBLE_EQ(range.cutOff(3.5, 3.55), 3.49);
  EXPECT_EQ(range.cutOff(3.88, 3.95), 0.0);
}

// A clock that ran back makes no old sample recent; the range stays known.
TEST(GyroRange, TimesAreForgottenAlone) {
  GyroRange range;
  for (int k = 0; k < 800; ++k) {
    Eigen::Vector3d rate = swing(k * kInterval);
    rate.y() = std::clamp(rate.y(), -3.49, 3.49);
    range.add(k * kInterval, rate);
  }
  EXPECT_DOUBLE_EQ(range.cutOff(0, 4), 3.49);
  range.forgetTimes();
  EXPECT_EQ(range.cutOff(0, 4), 0.0);
  EXPECT_DOUBLE_EQ(range.end(), 3.49);
}

TEST(GyroRange, WhatOnlyTurnsFastOrRepeatsItsSamplesHasNoEnd) {
  GyroRange fast, repeating, slow;
  for (int k = 0; k < 2000; ++k) {
    fast.add(k * kInterval, swing(k * kInterval));
    repeating.add(k * kInterval, swing((k - k % 4) * kInterval));
    slow.add(k * kInterval, {0.5, 0.5, 1.8});  // a simulated robot that turns steadily
  }
  EXPECT_EQ(fast.samples(), 0u);
  EXPECT_EQ(repeating.samples(), 0u);
  EXPECT_EQ(slow.samples(), 0u);
}

}  // namespace
}  // namespace vip_slam
