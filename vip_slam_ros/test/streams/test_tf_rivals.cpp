// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/tf_rivals.h"

namespace vip_slam {
namespace {

tf2_msgs::TFMessage message(const std::string& parent, const std::string& child) {
  tf2_msgs::TFMessage m;
  m.transforms.resize(2);
  m.transforms[0].header.frame_id = "camera_link";
  m.transforms[0].child_frame_id = "imu";
  m.transforms[1].header.frame_id = parent;
  m.transforms[1].child_frame_id = child;
  return m;
}

TEST(TfRivals, NamesAnotherSourceOfTheSameTransform) {
  TfRivals rivals("odom", "base_link", "/vip_slam/manager");
  rivals.add(message("odom", "base_link"), "/vip_slam/manager", 1, false);
  rivals.add(message("base_link", "camera_link"), "/robot", 1, false);
  EXPECT_EQ(rivals.words(1), "");
  rivals.add(message("/odom", "/base_link"), "/wheels", 2, false);
  EXPECT_EQ(rivals.words(2.5).find("/wheels publishes 'odom' -> 'base_link' too"), 0u) << rivals.words(2.5);
  EXPECT_EQ(rivals.words(20), "");  // it has ended
}

TEST(TfRivals, NamesAnotherParentOfTheSameFrame) {
  TfRivals rivals("odom", "base_link", "/vip_slam/manager");
  rivals.add(message("base_footprint", "base_link"), "/robot_state_publisher", 2, true);
  const std::string words = rivals.words(100);
  EXPECT_NE(words.find("'base_footprint' -> 'base_link' while 'odom' -> 'base_link' comes from here"),
            std::string::npos)
      << words;
}

}  // namespace
}  // namespace vip_slam
