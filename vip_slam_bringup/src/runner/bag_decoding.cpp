// SPDX-License-Identifier: BSD-3-Clause
#include "bag_decoding.h"

#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include <rosbag/exceptions.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include "vip_slam_core/util/size_text.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/stream_faults.h"

namespace vip_slam {
namespace {

enum Stream { kColor, kDepth, kGyro, kAccel, kStreams };

/// `decode` gets the image, raw with its owner or compressed. Empty: the image is of another frame.
template <class Decode>
std::optional<StampedImage> stampedImage(const rosbag::MessageInstance& message, OneFrame* frame,
                                         const Decode& decode) {
  if (const auto image = message.instantiate<sensor_msgs::Image>()) {
    if (!frame->admits(image->header.frame_id)) return std::nullopt;
    return StampedImage{image->header.stamp.toSec(), decode(*image, image), image->header.stamp.toNSec()};
  }
  if (const auto image = message.instantiate<sensor_msgs::CompressedImage>()) {
    if (!frame->admits(image->header.frame_id)) return std::nullopt;
    return StampedImage{image->header.stamp.toSec(), decode(*image), image->header.stamp.toNSec()};
  }
  throw std::invalid_argument("type " + message.getDataType() + ", expected sensor_msgs/Image or CompressedImage");
}

PairerOptions pairing(const InputOptions& input) {
  PairerOptions options;
  options.tolerance = input.pair_tolerance;
  options.patience = input.depth_patience;
  return options;
}

}  // namespace

BagDecoding::BagDecoding(const SensorConfig& sensor, const DepthToColour& to_colour, const BagReaderOptions& options,
                         Sink sink)
    : sensor_(sensor),
      to_colour_(to_colour),
      options_(options),
      sink_(std::move(sink)),
      pairer_(pairing(options.input)),
      time_(kStreams, options.input.time_jump,
            {[this](const ClockStep& step) { clockWasSet(step); }, [this](double seconds) { timeRanBack(seconds); }}) {
  focus_.start(sensor.camera);
}

void BagDecoding::take(const rosbag::MessageInstance& message) {
  const std::string& topic = message.getTopic();
  if (topic == sensor_.topics.color)
    decode(message, [&] { takeColor(message); });
  else if (topic == sensor_.topics.depth)
    decode(message, [&] { takeDepth(message); });
  else if (topic == sensor_.topics.color_info)
    takeInfo(message);
  else
    takeImu(message);
  handOut();
}

void BagDecoding::takeColor(const rosbag::MessageInstance& message) {
  const auto taken =
      stampedImage(message, &frames_[message.getTopic()], [this](const auto&... m) { return gray_(m...); });
  if (!taken) return;
  color_size_ = taken->image.size();
  const cv::Size calibrated(sensor_.camera.width, sensor_.camera.height);
  if (color_size_ != calibrated && ++counters_["images_of_wrong_size"] == 1)
    warnings_.push_back("topic " + message.getTopic() + ": images are " + sizeText(color_size_) +
                        ", the calibration is for " + sizeText(calibrated) + ": they cannot be used");
  take(kColor, taken->t, message, [this, taken](double t) { pairer_.addColor(t, taken->image, taken->stamp); });
}

void BagDecoding::takeInfo(const rosbag::MessageInstance& message) {
  const auto info = message.instantiate<sensor_msgs::CameraInfo>();
  if (!info) return;
  try {
    focus_.add(info->header.stamp.toSec(), intrinsicsFromCameraInfo(*info, sensor_.topics.color));
  } catch (const std::invalid_argument&) {
    // Empty ones come first with some drivers; the reader has found one that can be used.
  }
}

void BagDecoding::takeDepth(const rosbag::MessageInstance& message) {
  const auto taken = stampedImage(message, &frames_[message.getTopic()], [&](const auto& m, const auto&...) {
    return decodeDepth(m, sensor_.depth_scale, sensor_.depth_offset);
  });
  if (!taken) return;
  const cv::Mat depth = to_colour_(taken->image);
  if (!color_size_.empty() && depth.size() != color_size_)
    complain("sizes", "topic " + message.getTopic() + ": depth is " + sizeText(depth.size()) +
                          ", the colour images are " + sizeText(color_size_) +
                          ", so that no depth is used: switch on the driver's depth registration, or set " +
                          "depth/registered: false with the depth camera's calibration");
  ++depth_images_;
  without_any_ += holdsNoDepth(depth, sensor_.depth_noise);
  take(kDepth, taken->t, message, [this, depth](double t) { pairer_.addDepth(t, depth); });
}

void BagDecoding::takeImu(const rosbag::MessageInstance& message) {
  const std::string& topic = message.getTopic();
  const auto imu = message.instantiate<sensor_msgs::Imu>();
  if (!imu) {
    ++counters_["messages_of_wrong_type"];
    complain(topic, "topic " + topic + ": type " + message.getDataType() + ", expected sensor_msgs/Imu");
    return;
  }
  if (!frames_[topic].admits(imu->header.frame_id)) return;
  const Eigen::Vector3d gyro = fromMsg(imu->angular_velocity), accel = fromMsg(imu->linear_acceleration);
  const bool gyro_alone = topic == sensor_.topics.gyro, accel_alone = topic == sensor_.topics.accel;
  take(accel_alone ? kAccel : kGyro, imu->header.stamp.toSec(), message,
       [this, gyro, accel, gyro_alone, accel_alone](double t) {
         SensorEvent event = ImuSample{t, gyro, accel};
         if (gyro_alone) event = GyroSample{t, gyro};
         if (accel_alone) event = AccelSample{t, accel};
         open_ = open_ && sink_(std::move(event));
       });
}

void BagDecoding::take(int stream, double stamp, const rosbag::MessageInstance& message,
                       const StreamTime::Deliver& deliver) {
  time_.take(std::size_t(stream), stamp, message.getTime().toSec(), deliver);
}

void BagDecoding::clockWasSet(const ClockStep& step) {
  ++counters_["clock_steps"];
  const std::string topic = step.stream ? topicOf(*step.stream) : "";
  complain("step of " + topic, vip_slam::clockWasSet(step, topic));
  if (!step.stream && open_) open_ = sink_(ClockSet{step.time, step.seconds});
}

void BagDecoding::timeRanBack(double seconds) {
  ++counters_["time_jumps"];
  complain("time jump", vip_slam::timeRanBack(seconds) + ": the odometry starts anew there, the map goes on");
  pairer_.end();
  handOut();
  pairer_.clear();
  if (open_) open_ = sink_(TimeJump{seconds});
}

std::string BagDecoding::topicOf(std::size_t stream) const {
  const SensorTopics& topics = sensor_.topics;
  const std::string of_stream[] = {topics.color, topics.depth, topics.inertial(), topics.accel};
  return of_stream[stream];
}

void BagDecoding::handOut() {
  for (; open_ && pairer_.front(); pairer_.pop()) {
    ImagePair pair = *pairer_.front();
    focus_.apply(sensor_.depth_registered, &pair);
    open_ = sink_(std::move(pair));
  }
}

void BagDecoding::decode(const rosbag::MessageInstance& message, const std::function<void()>& use) {
  try {
    use();
  } catch (const rosbag::BagException&) {
    throw;  // an error of the bag, not of the image
  } catch (const std::exception& error) {
    ++counters_["undecodable_images"];
    complain(message.getTopic(), "topic " + message.getTopic() + ": " + error.what());
  }
}

void BagDecoding::complain(const std::string& about, const std::string& words) {
  if (complained_.insert(about).second) warnings_.push_back(words);
}

void BagDecoding::countUnreadable(const std::string& why) {
  if (++counters_["unreadable_messages"] == 1)
    warnings_.push_back("the bag is damaged, what cannot be read is left out: " + why);
  handOut();
}

void BagDecoding::finish() {
  time_.end();
  pairer_.end();
  handOut();
  if (!focus_.words().empty()) warnings_.push_back(focus_.words());
  if (!gray_.note().empty()) warnings_.push_back("topic " + sensor_.topics.color + ": " + gray_.note());
  const std::string& depth_topic = sensor_.topics.depth;
  const auto& pairs = pairer_.counters();
  const bool cause_known = complained_.count(depth_topic) > 0;  // it cannot be decoded
  if (!depth_topic.empty() && !cause_known && pairs.without_depth > 5 &&
      20 * pairs.without_depth > pairs.pairs + pairs.without_depth)
    warnings_.push_back("topic " + depth_topic + ": " + std::to_string(pairs.without_depth) + " of " +
                        std::to_string(pairs.pairs + pairs.without_depth) + " colour images have no depth within " +
                        std::to_string(std::lround(1e3 * options_.input.pair_tolerance)) +
                        " ms: switch on the driver's synchronisation, or equal rates; when check_bag finds "
                        "the depth elsewhere in the bag, sort that");
  if (2 * without_any_ > depth_images_)
    warnings_.push_back("topic " + depth_topic + ": " + std::to_string(without_any_) + " of " +
                        std::to_string(depth_images_) + " depth images " + holdNoDepth(sensor_.depth_noise));
  for (const auto& [topic, frame] : frames_) {
    if (frame.leftOut() == 0) continue;
    counters_["messages_of_another_frame"] += frame.leftOut();
    warnings_.push_back("topic " + topic + ": " + frame.words());
  }
  for (std::size_t stream = 0; stream < kStreams; ++stream) {
    const auto& [ahead, stray] = time_.leftOut(stream);
    counters_["messages_ahead"] += ahead;
    counters_["stray_messages"] += stray;
    if (ahead > 0) warnings_.push_back("topic " + topicOf(stream) + ": " + stampedAhead(ahead));
  }
  if (pairs.backward > 0)
    warnings_.push_back(std::to_string(pairs.backward) +
                        " images are left out: their stamps repeat or precede the one before");
  counters_["image_pairs"] = pairs.pairs;
  counters_["images_without_depth"] = pairs.without_depth;
  counters_["unused_depth_images"] = pairs.unused_depth;
  counters_["images_out_of_order"] = pairs.backward;
}

}  // namespace vip_slam
