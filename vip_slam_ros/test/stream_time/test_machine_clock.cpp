// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/stream_time/machine_clock.h"

namespace vip_slam {
namespace {

TEST(MachineClock, StampsChangeFromTheSettingOn) {
  MachineClock clock;
  clock.set(10, -0.9);
  clock.set(20, 0.2);
  EXPECT_DOUBLE_EQ(clock.stamp(9.99), 9.99);
  EXPECT_DOUBLE_EQ(clock.stamp(10), 9.1);
  EXPECT_DOUBLE_EQ(clock.stamp(20.5), 19.8);
}

TEST(MachineClock, AheadAndBackAgainWasWrong) {
  MachineClock clock;
  clock.set(5, -0.4);
  clock.set(10, 4.36);
  clock.set(12, -4.36);
  clock.set(15, 3.0);
  clock.set(16, 1.0);
  clock.set(18, -4.0);
  EXPECT_DOUBLE_EQ(clock.stamp(4), 4);
  EXPECT_DOUBLE_EQ(clock.stamp(11), 10.6);
  EXPECT_DOUBLE_EQ(clock.stamp(17), 16.6);
  EXPECT_DOUBLE_EQ(clock.stamp(20), 19.6);
}

}  // namespace
}  // namespace vip_slam
