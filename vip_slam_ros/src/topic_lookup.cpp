#include "vip_slam_ros/topic_lookup.h"

#include <algorithm>

namespace vip_slam {

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

}  // namespace vip_slam
