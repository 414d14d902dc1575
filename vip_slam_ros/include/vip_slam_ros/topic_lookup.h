// Explains why a topic has no messages, from the ROS master's information.
#pragma once

#include <string>

#include <ros/master.h>

namespace vip_slam {

/// Text for StreamMonitor::explainAbsence(): nobody publishes `topic` (resolved name), its type is not `type`
/// ("sensor_msgs/Image"; empty: any), or it is published but no message has arrived.
std::string whyNoMessage(const std::string& topic, const std::string& type, const ros::master::V_TopicInfo& published);

}  // namespace vip_slam
