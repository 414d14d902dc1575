// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "vip_slam_ros/topic_lookup.h"

namespace vip_slam {
namespace {

TEST(TopicLookup, SaysWhatKeepsATopicFromComing) {
  const ros::master::V_TopicInfo published = {{"/phone/color", "sensor_msgs/Image"}, {"/imu", "sensor_msgs/Imu"}};
  EXPECT_NE(whyNoMessage("/phone/colour", "sensor_msgs/Image", published).find("nobody publishes"), std::string::npos);
  EXPECT_NE(whyNoMessage("/imu", "sensor_msgs/Imu", published).find("nothing has come"), std::string::npos);
  const std::string other = whyNoMessage("/phone/color", "sensor_msgs/CompressedImage", published);
  EXPECT_NE(other.find("it is a sensor_msgs/Image, expected a sensor_msgs/CompressedImage"), std::string::npos)
      << other;
  EXPECT_NE(other.find("`compressed`"), std::string::npos) << other;
}

}  // namespace
}  // namespace vip_slam
