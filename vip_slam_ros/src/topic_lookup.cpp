// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/topic_lookup.h"

#include <netdb.h>

#include <algorithm>

#include <ros/network.h>
#include <ros/this_node.h>

namespace vip_slam {
namespace {

bool canBeResolved(const std::string& host) {
  addrinfo* found = nullptr;
  const bool known = ::getaddrinfo(host.c_str(), nullptr, nullptr, &found) == 0;
  if (found) ::freeaddrinfo(found);
  return known;
}

}  // namespace

Publishers publishersOfTopics() {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  Publishers out;
  if (!ros::master::execute("getSystemState", request, response, state, false) || state.size() < 1) return out;
  for (int i = 0; i < state[0].size(); ++i) {
    std::vector<std::string>& nodes = out[std::string(state[0][i][0])];
    for (int k = 0; k < state[0][i][1].size(); ++k) nodes.push_back(std::string(state[0][i][1][k]));
  }
  return out;
}

std::string whyNoMessage(const std::string& topic, const std::string& type, const ros::master::V_TopicInfo& published) {
  const auto found = std::find_if(published.begin(), published.end(),
                                  [&](const ros::master::TopicInfo& info) { return info.name == topic; });
  if (found == published.end()) return "nobody publishes it: is the name right, and the driver running?";
  if (type.empty() || found->datatype == type || found->datatype == "*") return "it is published, but nothing has come";
  std::string words = "it is a " + found->datatype + ", expected a " + type;
  const bool image = type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage";
  if (image) words += " (the sensor file's encoding: `compressed` for one, anything else for the other)";
  return words;
}

std::string whyUnreachable(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return "";
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(std::string(uri), host, port) || canBeResolved(host)) return "";
  return node + " runs on host '" + host + "', whose name cannot be resolved here: set ROS_IP there, or enter it in " +
         "/etc/hosts here";
}

}  // namespace vip_slam
