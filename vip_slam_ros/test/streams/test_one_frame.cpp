// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/one_frame.h"

namespace vip_slam {
namespace {

TEST(OneFrame, TheFirstFrameIsKeptAndTheOtherNamed) {
  OneFrame frame;
  EXPECT_TRUE(frame.admits("front_optical"));
  EXPECT_TRUE(frame.admits("/front_optical"));  // from before tf2
  EXPECT_EQ(frame.words(), "");
  EXPECT_FALSE(frame.admits("back_optical"));
  EXPECT_TRUE(frame.admits("front_optical"));
  EXPECT_FALSE(frame.admits(""));
  EXPECT_FALSE(frame.admits("back_optical"));
  EXPECT_EQ(frame.leftOut(), 3u);
  const std::string words = frame.words();
  EXPECT_NE(words.find("3 of 6 messages"), std::string::npos) << words;
  EXPECT_NE(words.find("'back_optical' instead of 'front_optical'"), std::string::npos) << words;
}

TEST(OneFrame, AnEmptyNameIsAFrameToo) {
  OneFrame frame;
  EXPECT_TRUE(frame.admits(""));
  EXPECT_TRUE(frame.admits(""));
  EXPECT_FALSE(frame.admits("camera"));
}

}  // namespace
}  // namespace vip_slam
