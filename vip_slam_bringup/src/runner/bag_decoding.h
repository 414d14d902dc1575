// SPDX-License-Identifier: BSD-3-Clause
// Converts a bag's messages to sensor events: images are decoded and paired, their time settled, irregularities
// counted and reported once each.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <rosbag/message_instance.h>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_core/sensor/depth_to_colour.h"
#include "vip_slam_ros/constant_focus.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/one_frame.h"
#include "vip_slam_ros/stream_time/stream_time.h"

namespace vip_slam {

class BagDecoding {
 public:
  /// Receives the events in order; returns false to stop.
  using Sink = std::function<bool(SensorEvent&&)>;
  /// `to_colour` and `sensor` must outlive this.
  BagDecoding(const SensorConfig& sensor, const DepthToColour& to_colour, const BagReaderOptions& options, Sink sink);

  /// Throws ros::Exception when the message cannot be read from the bag.
  void take(const rosbag::MessageInstance& message);
  void countUnreadable(const std::string& why);
  /// Delivers the last pairs and completes counters and warnings.
  void finish();
  bool open() const { return open_; }

  const std::map<std::string, std::uint64_t>& counters() const { return counters_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void takeColor(const rosbag::MessageInstance& message);
  void takeInfo(const rosbag::MessageInstance& message);
  void takeDepth(const rosbag::MessageInstance& message);
  void takeImu(const rosbag::MessageInstance& message);
  void take(int stream, double stamp, const rosbag::MessageInstance& message, const StreamTime::Deliver& deliver);
  void clockWasSet(const ClockStep& step);
  /// Messages before and after are not paired with each other.
  void timeRanBack(double seconds);
  std::string topicOf(std::size_t stream) const;
  void handOut();
  /// Counts an image that `use` cannot decode and warns once per topic.
  void decode(const rosbag::MessageInstance& message, const std::function<void()>& use);
  /// Adds a warning once per `about`.
  void complain(const std::string& about, const std::string& words);

  const SensorConfig& sensor_;
  const DepthToColour& to_colour_;
  const BagReaderOptions options_;
  Sink sink_;
  ImagePairer pairer_;
  StreamTime time_;
  std::map<std::string, OneFrame> frames_;  ///< of each topic
  GrayDecoder gray_;
  ConstantFocus focus_;
  bool open_ = true;
  cv::Size color_size_;
  std::size_t depth_images_ = 0, without_any_ = 0;  ///< depth images; those without a reading within the range
  std::set<std::string> complained_;
  std::map<std::string, std::uint64_t> counters_;
  std::vector<std::string> warnings_;
};

}  // namespace vip_slam
