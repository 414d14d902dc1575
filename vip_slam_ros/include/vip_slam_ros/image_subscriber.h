// SPDX-License-Identifier: BSD-3-Clause
// A stream of images by image_transport. Compressed ones are read without its plugins too, which Debian does not have.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <ros/node_handle.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

namespace vip_slam {

/// How the images of a topic are subscribed to.
struct ImageSource {
  std::string base;       ///< topic of the raw images; those of the transports lie below it
  std::string transport;  ///< of image_transport: raw, compressed, compressedDepth, theora ...
  bool plugin =
      true;           ///< by image_transport's plugin, which decodes; else sensor_msgs/CompressedImage comes from topic
  std::string topic;  ///< that messages come from

  /// Type of the messages on `topic`; empty for transports with types of their own.
  std::string type() const;
};

/// What a stream needs: `topic` and `encoding` as the sensor file has them, "compressed" for compressed images, whose
/// topic is usually one of a transport (".../compressed", ".../compressedDepth"); `transport` that the user wants,
/// empty: the topic's. `installed`: names of plugins, see installedTransports(). Without a plugin `compressed` and
/// `compressedDepth` are read all the same; depth on `compressed` (16-bit PNG) always is, since the plugin takes it for
/// 8 bit unless the format says otherwise. Throws std::invalid_argument when nothing reads the transport.
ImageSource chooseTransport(const std::string& topic, const std::string& encoding, const std::string& transport,
                            bool depth, const std::vector<std::string>& installed);

/// Full name of the topic that messages come from, by the remappings of the node.
std::string resolvedTopic(const ros::NodeHandle& nh, const ImageSource& source);

/// Transports that image_transport can load here, without its own name: "raw" always.
std::vector<std::string> installedTransports(const ros::NodeHandle& nh);

class ImageSubscriber {
 public:
  using Raw = std::function<void(const sensor_msgs::ImageConstPtr&)>;
  using Compressed = std::function<void(const sensor_msgs::CompressedImageConstPtr&)>;

  /// Subscribes; the callback that fits the source is called in the threads of `nh`, one message at a time. Throws
  /// image_transport::TransportLoadException when the plugin is not there.
  ImageSubscriber(const ros::NodeHandle& nh, const ImageSource& source, std::uint32_t queue, const Raw& raw,
                  const Compressed& compressed);

 private:
  std::unique_ptr<image_transport::ImageTransport> transport_;
  image_transport::SubscriberFilter images_;
  message_filters::Subscriber<sensor_msgs::CompressedImage> compressed_;
};

}  // namespace vip_slam
