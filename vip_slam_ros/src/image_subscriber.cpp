// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/image_subscriber.h"

#include <algorithm>
#include <stdexcept>

#include <image_transport/image_transport.h>
#include <boost/function.hpp>

namespace vip_slam {
namespace {

const std::string kRaw = "raw", kCompressed = "compressed", kCompressedDepth = "compressedDepth";
const std::string kPackage = "image_transport/";

bool isCompressed(const std::string& transport) { return transport == kCompressed || transport == kCompressedDepth; }

/// The last name of a topic that lies below a base; empty when there is none.
std::string lastName(const std::string& topic) {
  const std::size_t slash = topic.rfind('/');
  return slash == std::string::npos || slash == 0 ? "" : topic.substr(slash + 1);
}

}  // namespace

std::string ImageSource::type() const {
  if (transport == kRaw) return "sensor_msgs/Image";
  return isCompressed(transport) ? "sensor_msgs/CompressedImage" : "";
}

ImageSource chooseTransport(const std::string& topic, const std::string& encoding, const std::string& transport,
                            bool depth, const std::vector<std::string>& installed) {
  const bool compressed = encoding == kCompressed;
  const std::string last = compressed ? lastName(topic) : "";
  const bool below = isCompressed(last);
  ImageSource source;
  source.base = below ? topic.substr(0, topic.size() - last.size() - 1) : topic;
  source.transport = !transport.empty() ? transport : below ? last : compressed ? kCompressed : kRaw;
  if (transport.empty() && compressed && !below) {  // a name that image_transport would not look for
    source.plugin = false;
    source.topic = topic;
    return source;
  }
  const bool there = std::find(installed.begin(), installed.end(), source.transport) != installed.end();
  source.plugin = there && !(depth && source.transport == kCompressed);
  source.topic = source.transport == kRaw ? source.base : source.base + "/" + source.transport;
  if (!source.plugin && !isCompressed(source.transport)) {
    std::string names = kCompressed + ", " + kCompressedDepth;
    for (const std::string& name : installed)
      if (!isCompressed(name)) names += ", " + name;
    throw std::invalid_argument("image transport '" + source.transport + "' of " + source.base +
                                ": not installed; there are: " + names);
  }
  return source;
}

std::string resolvedTopic(const ros::NodeHandle& nh, const ImageSource& source) {
  if (source.topic.compare(0, source.base.size(), source.base) != 0) return nh.resolveName(source.topic);
  // As image_transport does: the base is remapped, and what lies below it follows.
  const std::string base = nh.resolveName(source.base), below = source.topic.substr(source.base.size());
  return below.empty() ? base : nh.resolveName(base + below);
}

std::vector<std::string> installedTransports(const ros::NodeHandle& nh) {
  std::vector<std::string> names = image_transport::ImageTransport(nh).getLoadableTransports();
  for (std::string& name : names)
    if (name.compare(0, kPackage.size(), kPackage) == 0) name.erase(0, kPackage.size());
  return names;
}

ImageSubscriber::ImageSubscriber(const ros::NodeHandle& nh, const ImageSource& source, std::uint32_t queue,
                                 const Raw& raw, const Compressed& compressed) {
  const auto hints = ros::TransportHints().tcpNoDelay();
  if (!source.plugin) {
    ros::NodeHandle handle(nh);
    compressed_.registerCallback(boost::function<void(const sensor_msgs::CompressedImageConstPtr&)>(compressed));
    const std::string topic = source.topic == source.base ? source.topic : resolvedTopic(nh, source);
    compressed_.subscribe(handle, topic, queue, hints);
    return;
  }
  transport_ = std::make_unique<image_transport::ImageTransport>(nh);
  images_.registerCallback(boost::function<void(const sensor_msgs::ImageConstPtr&)>(raw));
  // The transport is chosen already: the name is one that no parameter has.
  images_.subscribe(*transport_, source.base, queue,
                    image_transport::TransportHints(source.transport, hints, nh, "image_source/no_parameter"));
}

}  // namespace vip_slam
