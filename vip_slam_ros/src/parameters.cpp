// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/parameters.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace vip_slam {
namespace {

std::string toText(const std::string& name, XmlRpc::XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return static_cast<bool>(value) ? "true" : "false";
    case XmlRpc::XmlRpcValue::TypeInt:
      return std::to_string(static_cast<int>(value));
    case XmlRpc::XmlRpcValue::TypeString:
      return static_cast<std::string>(value);
    case XmlRpc::XmlRpcValue::TypeDouble: {
      std::ostringstream text;
      text.precision(17);
      text << static_cast<double>(value);
      return text.str();
    }
    default:
      throw std::invalid_argument("parameter " + name + ": a list, expected a single value");
  }
}

}  // namespace

std::vector<std::pair<std::string, std::string>> readParameters(const ros::NodeHandle& nh,
                                                                const std::set<std::string>& others) {
  std::vector<std::string> all;
  nh.getParamNames(all);
  const std::string prefix = nh.getNamespace() == "/" ? "/" : nh.getNamespace() + "/";
  std::vector<std::pair<std::string, std::string>> values;
  for (const std::string& path : all) {
    if (path.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string name = path.substr(prefix.size());
    XmlRpc::XmlRpcValue value;
    if (!others.count(name) && nh.getParam(path, value)) values.emplace_back(name, toText(path, value));
  }
  std::sort(values.begin(), values.end());
  return values;
}

}  // namespace vip_slam
