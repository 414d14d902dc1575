// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/markers.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

std_msgs::ColorRGBA makeColor(double r, double g, double b, double a) {
  std_msgs::ColorRGBA color;
  color.r = float(r);
  color.g = float(g);
  color.b = float(b);
  color.a = float(a);
  return color;
}

std_msgs::ColorRGBA colorOfId(std::uint64_t id, double alpha) {
  constexpr double kGolden = 0.61803398874989484820, kSaturation = 0.65, kValue = 0.95;
  const double hue = 6.0 * std::fmod(double(id % 100000) * kGolden, 1.0);
  const auto channel = [hue](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return kValue * (1.0 - kSaturation * std::max(0.0, std::min({k, 4.0 - k, 1.0})));
  };
  return makeColor(channel(5), channel(3), channel(1), alpha);
}

visualization_msgs::Marker makeMarker(const std_msgs::Header& header, const std::string& ns, int id, int type) {
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = ns;
  marker.id = id;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1;
  marker.scale.x = marker.scale.y = marker.scale.z = 1;
  return marker;
}

visualization_msgs::Marker makeDeletion(const std_msgs::Header& header, const std::string& ns, int id) {
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = ns;
  marker.id = id;
  marker.action = visualization_msgs::Marker::DELETE;
  return marker;
}

}  // namespace vip_slam
