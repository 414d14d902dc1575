// SPDX-License-Identifier: BSD-3-Clause
// Fills a Recording from messages, whether they come from a bag or from live topics.
#pragma once

#include <memory>
#include <string>

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include "vip_slam_bringup/preflight/depth_edges.h"
#include "vip_slam_bringup/preflight/edge_shift.h"
#include "vip_slam_bringup/preflight/image_rotation.h"
#include "vip_slam_bringup/preflight/recording.h"
#include "vip_slam_core/depth/missing_reading.h"
#include "vip_slam_core/sensor/depth_to_colour.h"
#include "vip_slam_frontend/tracking/depth_unit.h"
#include "vip_slam_frontend/tracking/frozen_depth.h"
#include "vip_slam_ros/bag_files.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/stream_time/stream_time.h"

namespace vip_slam {

class Recorder {
 public:
  /// Images are decoded for the first `image_seconds` of the recording only; stamps are kept throughout.
  Recorder(const SensorConfig& sensor, bool live, double image_seconds);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// With the `owner` of the message a grey image is kept without a copy.
  void add(const std::string& topic, double arrival, const sensor_msgs::Image& message, const MessageOwner& owner = {});
  void add(const std::string& topic, double arrival, const sensor_msgs::CompressedImage& message);
  void add(const std::string& topic, double arrival, const sensor_msgs::CameraInfo& message);
  void add(const std::string& topic, double arrival, const sensor_msgs::Imu& message);
  void add(const tf2_msgs::TFMessage& message);
  /// All existing topics, used or not.
  void setTopics(std::map<std::string, std::string> topics) { recording_.topics = std::move(topics); }

  /// After the last message.
  void finish();
  const Recording& recording() const { return recording_; }

 private:
  template <class ImageMessage, class Gray>
  void addImage(const std::string& topic, double arrival, const ImageMessage& message, const std::string& encoding,
                const Gray& gray);
  enum Stream { kColor, kDepth, kInertial, kAccel, kStreams };
  void take(Stream stream, double arrival, const std_msgs::Header& header, StreamTime::Deliver deliver);
  StreamRecord& recordOf(Stream stream);
  void addDepth(double t, cv::Mat depth);
  void addGray(double t, const cv::Mat& gray);
  bool turns() const;
  /// The motion to the image at t, its depth in the unit of the first ones.
  void addMotion(double t, const cv::Mat& gray, cv::Mat depth);
  void flushGray(bool all);
  /// From when the colour camera is known.
  void startRotation(const CameraIntrinsics& camera);

  Recording recording_;
  GrayDecoder gray_;
  const double image_seconds_;
  double first_image_ = -1;
  StreamTime time_;
  double restarted_by_ = 0;  ///< s by which stamps are earlier than at the beginning
  ImageRotation rotation_;
  std::shared_ptr<const CameraModel> camera_;  ///< null: not known yet
  std::unique_ptr<frontend::DepthUnit> depth_unit_;
  SE3 T_odom_C_;                              ///< by the steps since one was missing
  std::unique_ptr<DepthToColour> to_colour_;  ///< of registered depth; null: depth is taken as it comes
  std::unique_ptr<DepthEdges> depth_edges_;   ///< null: depth is not registered
  EdgeShifts edge_shifts_;
  double edges_at_ = -1e9;  ///< stamp of the image whose edges were looked at last
  struct Stamped {
    double t;
    cv::Mat image;
  };
  FrozenDepth frozen_depth_;
  MissingReading missing_reading_;
  cv::Mat newest_gray_;                               ///< newest image that was not a repetition
  std::vector<Stamped> waiting_gray_, recent_depth_;  ///< colour images wait a moment for their depth
};

/// Reads the bags of a recording. Throws std::runtime_error naming the file when they cannot be read.
Recording recordBag(const BagSet& bags, const SensorConfig& sensor, double image_seconds);
/// Listens to the sensor's topics for `seconds`. Needs ros::init(); throws std::runtime_error without a master.
Recording recordLive(const SensorConfig& sensor, double seconds);

}  // namespace vip_slam
