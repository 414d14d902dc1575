// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/bag_reader.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include <sensor_msgs/CameraInfo.h>

#include "vip_slam_bringup/runner/bag_extrinsics.h"
#include "vip_slam_core/sensor/depth_to_colour.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/tf_lookup.h"

#include "bag_decoding.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr std::size_t kAhead = 200;  // events, of which about one in ten is an image pair of 1.5 MB

std::string join(const std::set<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

}  // namespace

struct BagReader::Source {
  explicit Source(BagSet set) : bags(std::move(set)) {}

  const BagSet bags;
  ros::Time begin, end;
  std::unique_ptr<const DepthToColour> to_colour;

  void checkTopics(const SensorConfig& sensor) {
    const SensorTopics& topics = sensor.topics;
    std::map<std::string, std::string> there;  // with their types
    std::set<std::string> names, missing;
    const auto view = bags.view();
    for (const rosbag::ConnectionInfo* connection : view->getConnections()) {
      there[connection->topic] = connection->datatype;
      names.insert(connection->topic);
    }
    const auto check = [&](const std::string& topic, const std::set<std::string>& types) {
      if (topic.empty()) return;
      const auto found = there.find(topic);
      if (found == there.end())
        missing.insert(topic);
      else if (types.count(found->second) == 0)
        throw std::runtime_error(bags.name() + ": topic " + topic + " is " + found->second + ", expected " +
                                 join(types) + "; is it the right topic in sensor '" + sensor.name + "'?");
    };
    for (const std::string& topic : {topics.color, topics.depth})
      check(topic, {"sensor_msgs/Image", "sensor_msgs/CompressedImage"});
    for (const std::string& topic : {topics.imu, topics.gyro, topics.accel}) check(topic, {"sensor_msgs/Imu"});
    if (!missing.empty()) {
      const bool imu_there_or_unwanted =
          !topics.hasInertial() ||
          std::any_of(there.begin(), there.end(), [](const auto& topic) { return topic.second == "sensor_msgs/Imu"; });
      throw std::runtime_error(
          bags.name() + ": no topic " + join(missing) + ", which sensor '" + sensor.name +
          "' names; in the bag are: " + join(names) +
          (imu_there_or_unwanted ? "" : " (without an IMU: topics/imu, gyro and accel \"\" in the sensor file)"));
    }
  }

  /// The first one that can be used, as live: drivers send empty ones until they have read the device.
  CameraIntrinsics cameraInfo(const std::string& topic, const std::string& image_topic,
                              std::vector<std::string>* warnings) {
    const auto view = bags.view({topic});
    std::string problem;
    for (const auto& message : *view) {
      const auto info = message.instantiate<sensor_msgs::CameraInfo>();
      if (!info) {
        throw std::runtime_error(bags.name() + ": topic " + topic + " is " + message.getDataType() +
                                 ", expected sensor_msgs/CameraInfo");
      }
      try {
        const CameraIntrinsics camera = intrinsicsFromCameraInfo(*info, image_topic);
        const std::string note = cameraInfoNote(*info);
        if (!note.empty()) warnings->push_back("topic " + topic + ": " + note);
        return camera;
      } catch (const std::exception& error) {
        problem = error.what();
      }
    }
    if (!problem.empty()) throw std::runtime_error(bags.name() + ": topic " + topic + ": " + problem);
    throw std::runtime_error(bags.name() + ": topic " + topic + ": no camera_info in the bag; name the right topic " +
                             "or put the intrinsics into the sensor configuration");
  }
};

BagReader::BagReader(BagSet bags, SensorConfig& sensor, const BagReaderOptions& options)
    : source_(std::make_unique<Source>(std::move(bags))), options_(options), channel_(kAhead) {
  source_->checkTopics(sensor);
  if (sensor.intrinsics_from_camera_info) {
    sensor.camera = source_->cameraInfo(sensor.topics.color_info, sensor.topics.color, &warnings_);
    if (!sensor.depth_registered) {
      sensor.depth_camera = source_->cameraInfo(sensor.topics.depth_info, sensor.topics.depth, &warnings_);
    }
  }
  source_->to_colour = std::make_unique<DepthToColour>(sensor);

  const auto all = source_->bags.view();
  source_->begin = all->getBeginTime() + ros::Duration(std::max(0.0, options.start));
  source_->end = all->getEndTime();
  if (options.duration >= 0) source_->end = std::min(source_->end, source_->begin + ros::Duration(options.duration));
  if (source_->begin > source_->end) {
    throw std::runtime_error(source_->bags.name() + ": --start " + std::to_string(options.start) +
                             " s lies behind the end of the bag, which lasts " +
                             std::to_string((all->getEndTime() - all->getBeginTime()).toSec()) + " s");
  }
  if (options.extrinsics != "config" && sensor.topics.hasInertial()) takeExtrinsics(&sensor);
  const std::string wrong = leverArmProblem(sensor.T_imu_cam, options.input.max_lever_arm);
  if (!wrong.empty())
    throw std::runtime_error(source_->bags.name() + ": T_imu_cam (" + extrinsics_source_ + "): " + wrong);
  sensor_ = sensor;
}

void BagReader::takeExtrinsics(SensorConfig* sensor) {
  const BagExtrinsics found = extrinsicsInBag(source_->bags, sensor->topics, source_->begin, options_.tf_patience);
  if (!found.T_imu_cam) {
    if (options_.extrinsics != "tf") return;
    throw std::runtime_error(source_->bags.name() + ": " + whyNoExtrinsics(found.imu_frame, found.camera_frame) +
                             "; record /tf_static, or use the sensor file's extrinsics");
  }
  extrinsics_source_ = "tf: " + found.camera_frame + " to " + found.imu_frame;
  const ExtrinsicsGap off = extrinsicsGap(sensor->T_imu_cam, *found.T_imu_cam);
  if (off.large()) {
    warnings_.push_back(formatted(
        "extrinsics (%s) differ from the sensor file's T_imu_cam by %.1f degrees and %.1f cm: tf is used; --extrinsics "
        "config takes the file's",
        extrinsics_source_.c_str(), off.degrees, 100 * off.metres));
  }
  sensor->T_imu_cam = *found.T_imu_cam;
}

BagReader::~BagReader() { stop(); }

void BagReader::stop() {
  stop_ = true;
  channel_.close();
  if (thread_.joinable()) thread_.join();
}

const BagSet& BagReader::bags() const { return source_->bags; }
double BagReader::beginTime() const { return source_->begin.toSec(); }
double BagReader::endTime() const { return source_->end.toSec(); }

void BagReader::start() {
  thread_ = std::thread([this] {
    try {
      read();
    } catch (const std::exception& error) {
      warnings_.push_back(std::string("the bag breaks off: ") + error.what());
      damaged_ = true;
    }
    channel_.close();
  });
}

std::optional<SensorEvent> BagReader::next() { return channel_.pop(); }

void BagReader::read() {
  const SensorTopics& topics = sensor_.topics;
  std::vector<std::string> names;
  for (const auto& name : {topics.color, topics.depth, topics.imu, topics.gyro, topics.accel}) {
    if (!name.empty()) names.push_back(name);
  }
  if (sensor_.intrinsics_from_camera_info) names.push_back(topics.color_info);
  BagDecoding decoding(sensor_, *source_->to_colour, options_,
                       [this](SensorEvent&& event) { return channel_.push(std::move(event)); });
  const auto report = [&] {
    counters_ = decoding.counters();
    warnings_.insert(warnings_.end(), decoding.warnings().begin(), decoding.warnings().end());
  };
  try {
    const auto view = source_->bags.view(names, source_->begin, source_->end);
    for (const auto& message : *view) {
      if (stop_ || !decoding.open()) break;
      try {
        decoding.take(message);
      } catch (const ros::Exception& error) {  // a damaged chunk or message; those after it may be intact
        damaged_ = true;
        decoding.countUnreadable(error.what());
      }
    }
  } catch (...) {
    report();
    throw;
  }
  decoding.finish();
  report();
}

}  // namespace vip_slam
