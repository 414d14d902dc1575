#include "vip_slam_bringup/runner/bag_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include "vip_slam_bringup/runner/bag_extrinsics.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_ros/bag_files.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/stream_clock.h"
#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {
namespace {

constexpr std::size_t kAhead = 200;  // events, of which about one in ten is an image pair of 1.5 MB

std::string join(const std::set<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

std::string sizeText(const cv::Size& size) { return std::to_string(size.width) + "x" + std::to_string(size.height); }

/// `decode` gets the image, raw or compressed.
template <class Decode>
StampedImage stampedImage(const rosbag::MessageInstance& message, const Decode& decode) {
  if (const auto image = message.instantiate<sensor_msgs::Image>())
    return {image->header.stamp.toSec(), decode(*image), 0};
  if (const auto image = message.instantiate<sensor_msgs::CompressedImage>())
    return {image->header.stamp.toSec(), decode(*image), 0};
  throw std::invalid_argument("type " + message.getDataType() + ", expected sensor_msgs/Image or CompressedImage");
}

enum Stream { kColor, kDepth, kGyro, kAccel, kStreams };

}  // namespace

struct BagReader::Source {
  rosbag::Bag bag;
  ros::Time begin, end;
  std::unique_ptr<const DepthRegistration> registration;  // only for depth that is not registered

  void open(const std::string& path) {
    openBag(path, &bag);
    if (rosbag::View(bag).size() == 0) throw std::runtime_error(path + ": an empty bag");
  }

  void checkTopics(const SensorConfig& sensor) {
    const SensorTopics& topics = sensor.topics;
    std::set<std::string> there, missing;
    rosbag::View view(bag);
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) there.insert(connection->topic);
    for (const std::string& topic : {topics.color, topics.depth, topics.imu, topics.gyro, topics.accel}) {
      if (!topic.empty() && there.count(topic) == 0) missing.insert(topic);
    }
    if (!missing.empty()) {
      throw std::runtime_error(bag.getFileName() + ": no topic " + join(missing) + ", which sensor '" + sensor.name +
                               "' names; in the bag are: " + join(there));
    }
  }

  CameraIntrinsics cameraInfo(const std::string& topic, const std::string& image_topic) {
    rosbag::View view(bag, rosbag::TopicQuery(topic));
    for (const auto& message : view) {
      const auto info = message.instantiate<sensor_msgs::CameraInfo>();
      if (!info) {
        throw std::runtime_error(bag.getFileName() + ": topic " + topic + " is " + message.getDataType() +
                                 ", expected sensor_msgs/CameraInfo");
      }
      try {
        return intrinsicsFromCameraInfo(*info, image_topic);
      } catch (const std::exception& error) {
        throw std::runtime_error(bag.getFileName() + ": topic " + topic + ": " + error.what());
      }
    }
    throw std::runtime_error(bag.getFileName() + ": topic " + topic +
                             ": no camera_info in the bag; name the right topic " +
                             "or put the intrinsics into the sensor configuration");
  }
};

BagReader::BagReader(const std::string& path, SensorConfig& sensor, const BagReaderOptions& options)
    : source_(std::make_unique<Source>()), options_(options), channel_(kAhead) {
  source_->open(path);
  source_->checkTopics(sensor);
  if (sensor.intrinsics_from_camera_info) {
    sensor.camera = source_->cameraInfo(sensor.topics.color_info, sensor.topics.color);
    if (!sensor.depth_registered) {
      sensor.depth_camera = source_->cameraInfo(sensor.topics.depth_info, sensor.topics.depth);
    }
  }
  if (!sensor.depth_registered) {
    source_->registration = std::make_unique<DepthRegistration>(
        makeCamera(sensor.depth_camera), makeCamera(sensor.camera), sensor.T_color_depth.matrix());
  }

  rosbag::View all(source_->bag);
  source_->begin = all.getBeginTime() + ros::Duration(std::max(0.0, options.start));
  source_->end = all.getEndTime();
  if (options.duration >= 0) source_->end = std::min(source_->end, source_->begin + ros::Duration(options.duration));
  if (source_->begin > source_->end) {
    throw std::runtime_error(path + ": --start lies behind the end of the bag, which lasts " +
                             std::to_string((all.getEndTime() - all.getBeginTime()).toSec()) + " s");
  }
  if (options.extrinsics != "config") takeExtrinsics(&sensor);
  sensor_ = sensor;
}

void BagReader::takeExtrinsics(SensorConfig* sensor) {
  const BagExtrinsics found = extrinsicsInBag(source_->bag, sensor->topics, source_->begin, options_.tf_patience);
  if (!found.T_imu_cam) {
    if (options_.extrinsics != "tf") return;
    throw std::runtime_error(source_->bag.getFileName() + ": tf does not connect '" + found.camera_frame + "' to '" +
                             found.imu_frame + "'; record /tf_static, or use the sensor file's extrinsics");
  }
  extrinsics_source_ = "tf: " + found.camera_frame + " to " + found.imu_frame;
  const MountingGap off = mountingGap(sensor->T_imu_cam, *found.T_imu_cam);
  if (off.large()) {
    char words[160];
    std::snprintf(words, sizeof words, "differ from the sensor file's T_imu_cam by %.1f degrees and %.1f cm",
                  off.degrees, 100 * off.metres);
    warnings_.push_back("extrinsics (" + extrinsics_source_ + ") " + words +
                        ": tf is used; --extrinsics config takes the file's");
  }
  sensor->T_imu_cam = *found.T_imu_cam;
}

BagReader::~BagReader() { stop(); }

void BagReader::stop() {
  stop_ = true;
  channel_.close();
  if (thread_.joinable()) thread_.join();
}

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
  ImagePairer pairer(options_.pairing);
  StreamClock clock(kStreams, options_.time_jump);
  bool open = true;
  const auto handOut = [&] {
    for (; open && pairer.front(); pairer.pop()) open = channel_.push(*pairer.front());
  };
  // As in the live system: what belongs together is told from what comes before and after a jump of the clock.
  const auto inTime = [&](Stream stream, double t) {
    const StreamClock::Verdict verdict = clock.notice(stream, t);
    if (verdict == StreamClock::Verdict::kStray) ++counters_["stray_messages"];
    if (verdict == StreamClock::Verdict::kJumpedBack) {
      ++counters_["time_jumps"];
      pairer.end();
      handOut();
      pairer.clear();
      if (open) open = channel_.push(TimeJump{clock.lastJump()});
    }
    return open && verdict != StreamClock::Verdict::kStray;
  };
  std::set<std::string> complained;
  const auto decode = [&](const rosbag::MessageInstance& message, auto&& use) {
    try {
      use();
    } catch (const rosbag::BagException&) {
      throw;
    } catch (const std::exception& error) {
      ++counters_["undecodable_images"];
      if (complained.insert(message.getTopic()).second) {
        warnings_.push_back("topic " + message.getTopic() + ": " + error.what());
      }
    }
  };

  const cv::Size calibrated(sensor_.camera.width, sensor_.camera.height);
  const auto compareWithCalibration = [&](const cv::Mat& image) {
    if (image.size() == calibrated) return;
    if (++counters_["images_of_wrong_size"] > 1) return;
    warnings_.push_back("topic " + topics.color + ": images are " + sizeText(image.size()) +
                        ", the calibration is for " + sizeText(calibrated) + ": they cannot be used");
  };
  cv::Size color_size;
  std::size_t depth_images = 0, without_any = 0;
  const auto compareSizes = [&](const cv::Mat& depth) {
    if (color_size.empty() || depth.size() == color_size || !complained.insert("sizes").second) return;
    warnings_.push_back("topic " + topics.depth + ": depth is " + sizeText(depth.size()) + ", the colour images are " +
                        sizeText(color_size) + ", so that no depth is used: switch on the driver's depth " +
                        "registration, or set depth/registered: false with the depth camera's calibration");
  };

  const auto take = [&](const rosbag::MessageInstance& message) {
    const std::string& topic = message.getTopic();
    if (topic == topics.color) {
      decode(message, [&] {
        const auto [t, image, stamp] = stampedImage(message, [](const auto& m) { return decodeGray(m); });
        color_size = image.size();
        compareWithCalibration(image);
        if (inTime(kColor, t)) pairer.addColor(t, image);
      });
    } else if (topic == topics.depth) {
      decode(message, [&] {
        auto [t, depth, stamp] = stampedImage(
            message, [&](const auto& m) { return decodeDepth(m, sensor_.depth_scale, sensor_.depth_offset); });
        if (source_->registration) depth = (*source_->registration)(depth);
        compareSizes(depth);
        ++depth_images;
        without_any += holdsNoDepth(depth, sensor_.depth_noise);
        if (inTime(kDepth, t)) pairer.addDepth(t, depth);
      });
    } else if (const auto imu = message.instantiate<sensor_msgs::Imu>()) {
      const double t = imu->header.stamp.toSec();
      const Eigen::Vector3d gyro = fromMsg(imu->angular_velocity), accel = fromMsg(imu->linear_acceleration);
      if (inTime(topic == topics.accel ? kAccel : kGyro, t)) {
        SensorEvent event = ImuSample{t, gyro, accel};
        if (topic == topics.gyro) event = GyroSample{t, gyro};
        if (topic == topics.accel) event = AccelSample{t, accel};
        open = channel_.push(std::move(event));
      }
    } else {
      ++counters_["messages_of_wrong_type"];
      if (complained.insert(topic).second) {
        warnings_.push_back("topic " + topic + ": type " + message.getDataType() + ", expected sensor_msgs/Imu");
      }
    }
  };

  rosbag::View view(source_->bag, rosbag::TopicQuery(names), source_->begin, source_->end);
  for (const auto& message : view) {
    if (stop_) break;
    try {
      take(message);
    } catch (const ros::Exception& error) {  // a chunk or a message that is damaged; those after it may be whole
      damaged_ = true;
      if (++counters_["unreadable_messages"] == 1)
        warnings_.push_back(std::string("the bag is damaged, what cannot be read is left out: ") + error.what());
    }
    handOut();
    if (!open) break;
  }
  pairer.end();
  handOut();
  const std::size_t paired = pairer.counters().pairs, alone = pairer.counters().without_depth;
  if (!topics.depth.empty() && alone > 5 && 20 * alone > paired + alone)
    warnings_.push_back("topic " + topics.depth + ": " + std::to_string(alone) + " of " +
                        std::to_string(paired + alone) + " colour images have no depth within " +
                        std::to_string(std::lround(1e3 * options_.pairing.tolerance)) +
                        " ms: switch on the driver's synchronisation, or equal rates; when check_bag finds "
                        "the depth elsewhere in the bag, sort that");
  if (2 * without_any > depth_images) {
    char range[60];
    std::snprintf(range, sizeof range, "%g to %g m", sensor_.depth_noise.min_range, sensor_.depth_noise.max_range);
    warnings_.push_back("topic " + topics.depth + ": " + std::to_string(without_any) + " of " +
                        std::to_string(depth_images) + " depth images hold nothing within " + range +
                        ", the sensor file's range: wrong depth/scale, emitter off, wrong topic?");
  }
  if (const std::size_t backward = pairer.counters().backward; backward > 0)
    warnings_.push_back(std::to_string(backward) +
                        " images are left out: their stamps repeat or precede the one before");
  if (const auto jumps = counters_.find("time_jumps"); jumps != counters_.end())
    warnings_.push_back(
        "time ran backwards " + std::to_string(jumps->second) +
        " times (a bag that was joined, or recorded while another was played in a loop?): the odometry " +
        "starts anew there, the map goes on");
  counters_["image_pairs"] = pairer.counters().pairs;
  counters_["images_without_depth"] = pairer.counters().without_depth;
  counters_["unused_depth_images"] = pairer.counters().unused_depth;
  counters_["images_out_of_order"] = pairer.counters().backward;
}

}  // namespace vip_slam
