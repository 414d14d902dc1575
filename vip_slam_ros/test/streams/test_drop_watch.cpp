// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/drop_watch.h"

namespace vip_slam {
namespace {

TEST(DropWatch, WarnsWhileMessagesAreDroppedAndNotForGood) {
  DropWatch watch;
  EXPECT_FALSE(watch.lately(0, 1e9));
  EXPECT_TRUE(watch.lately(1, 1e9 + 1));
  EXPECT_TRUE(watch.lately(1, 1e9 + 30));
  EXPECT_FALSE(watch.lately(1, 1e9 + 32));
  EXPECT_TRUE(watch.lately(2, 1e9 + 33));
  EXPECT_TRUE(watch.lately(3, 1e9 + 60));
  EXPECT_TRUE(watch.lately(3, 1e9 + 89));
  EXPECT_FALSE(watch.lately(3, 1e9 + 91));
}

TEST(DropWatch, BeginsAnewWithASmallerCount) {
  DropWatch watch;
  EXPECT_TRUE(watch.lately(7, 100));
  EXPECT_FALSE(watch.lately(0, 200));
  EXPECT_TRUE(watch.lately(1, 201));
}

}  // namespace
}  // namespace vip_slam
