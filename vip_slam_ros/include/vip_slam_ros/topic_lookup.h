// SPDX-License-Identifier: BSD-3-Clause
// What the ROS master knows of a topic: why it has no messages, who publishes it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <ros/master.h>

namespace vip_slam {

/// Topic (resolved name) -> nodes that publish it. Empty when the master does not answer.
using Publishers = std::map<std::string, std::vector<std::string>>;
Publishers publishersOfTopics();

/// Text for StreamMonitor::explainAbsence(): nobody publishes `topic` (resolved name), its type is not `type`
/// ("sensor_msgs/Image"; empty: any), or it is published but no message has arrived.
std::string whyNoMessage(const std::string& topic, const std::string& type, const ros::master::V_TopicInfo& published);

/// Why nothing comes from a node (full name) that publishes: its host's name cannot be resolved here. Empty when it can
/// or the master does not know the node. May take as long as a name server that does not answer.
std::string whyUnreachable(const std::string& node);

}  // namespace vip_slam
