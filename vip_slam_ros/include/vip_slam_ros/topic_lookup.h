// Why a topic brings nothing, by what the ROS master knows of it.
#pragma once

#include <string>

#include <ros/master.h>

namespace vip_slam {

/// Words for StreamMonitor::explainAbsence(): nobody publishes `topic` (resolved name), its type is not `type`
/// ("sensor_msgs/Image"), or it is there but nothing has come.
std::string whyNoMessage(const std::string& topic, const std::string& type, const ros::master::V_TopicInfo& published);

}  // namespace vip_slam
