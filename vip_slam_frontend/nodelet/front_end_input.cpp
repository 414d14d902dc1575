// SPDX-License-Identifier: BSD-3-Clause
// Sensor input: images are decoded in the callback threads, then all is passed to the thread that owns the estimator.
#include "front_end_nodelet.h"

#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/image_decoding.h"

namespace vip_slam {

std::string FrontEndNodelet::resolved(const std::string& topic) const {
  return topic.empty() ? "" : getNodeHandle().resolveName(topic);
}

SensorConfig FrontEndNodelet::withResolvedTopics() const {
  SensorConfig sensor = sensor_;
  SensorTopics& t = sensor.topics;
  for (std::string* topic : {&t.color, &t.color_info, &t.depth, &t.depth_info, &t.imu, &t.gyro, &t.accel})
    *topic = resolved(*topic);
  return sensor;
}

void FrontEndNodelet::subscribe() {
  const SensorTopics& topics = sensor_.topics;
  ros::NodeHandle& nh = getMTNodeHandle();
  color_monitor_ = std::make_unique<StreamMonitor>(resolvedTopic(nh, color_source_), sensor_.color_rate);
  depth_monitor_ =
      std::make_unique<StreamMonitor>(topics.depth.empty() ? "" : resolvedTopic(nh, depth_source_), sensor_.depth_rate);
  imu_monitor_ = std::make_unique<StreamMonitor>(resolved(topics.inertial()), sensor_.imu_rate);
  accel_monitor_ = std::make_unique<StreamMonitor>(resolved(topics.accel), 0);

  const auto hints = ros::TransportHints().tcpNoDelay();
  if (sensor_.intrinsics_from_camera_info) {
    subscribers_.push_back(nh.subscribe<sensor_msgs::CameraInfo>(
        topics.color_info, 5, [this](const sensor_msgs::CameraInfoConstPtr& m) { onColorInfo(m); }));
    if (!sensor_.depth_registered) {
      subscribers_.push_back(nh.subscribe<sensor_msgs::CameraInfo>(
          topics.depth_info, 5, [this](const sensor_msgs::CameraInfoConstPtr& m) { calibration_->addDepthInfo(*m); }));
    }
  }
  // Capacity of a topic's queue: images that come while one is being decoded. Each topic keeps its order.
  const auto queue = std::uint32_t(options_.image_queue);
  color_images_ = std::make_unique<ImageSubscriber>(
      nh, color_source_, queue,
      [this](const sensor_msgs::ImageConstPtr& m) { onColor(m->header, [this, m] { return gray_(*m, m); }); },
      [this](const sensor_msgs::CompressedImageConstPtr& m) { onColor(m->header, [this, m] { return gray_(*m); }); });
  if (!topics.depth.empty()) {
    const double scale = sensor_.depth_scale, offset = sensor_.depth_offset;
    const auto take = [this, scale, offset](const auto& m) {
      onDepth(m->header, [m, scale, offset] { return decodeDepth(*m, scale, offset); });
    };
    depth_images_ = std::make_unique<ImageSubscriber>(nh, depth_source_, queue, take, take);
  }
  // One ordered queue for small and frequent messages; images are decoded in other threads.
  ros::NodeHandle& ordered = getNodeHandle();
  const auto imu = [&](const std::string& topic, void (FrontEndNodelet::*callback)(const sensor_msgs::ImuConstPtr&)) {
    if (!topic.empty()) subscribers_.push_back(ordered.subscribe(topic, 1000, callback, this, hints));
  };
  imu(topics.imu, &FrontEndNodelet::onImu);
  imu(topics.gyro, &FrontEndNodelet::onGyro);
  imu(topics.accel, &FrontEndNodelet::onAccel);
  subscribers_.push_back(ordered.subscribe("map_update", 20, &FrontEndNodelet::onMapUpdate, this));
  subscribers_.push_back(ordered.subscribe("control", 20, &FrontEndNodelet::onControl, this));
  rivals_->listen(ordered);
}

bool FrontEndNodelet::watch(StreamMonitor& monitor, const std_msgs::Header& header) {
  const double now = ros::Time::now().toSec();
  if (!monitor.admits(header.frame_id, now)) return false;
  monitor.add(header.stamp.toSec(), now);
  return true;
}

void FrontEndNodelet::post(OwnerThread::Lane lane, Stream stream, const std_msgs::Header& header,
                           StreamTime::Deliver deliver) {
  // Arrival is told by a clock that nobody sets; with the time of a bag that is played, by that.
  const double arrival = ros::Time::isSimTime() ? ros::Time::now().toSec() : ros::SteadyTime::now().toSec();
  owner_->post(lane, [this, stream, stamp = header.stamp.toSec(), arrival, deliver = std::move(deliver)] {
    if (!paused_) time_->take(stream, stamp, arrival, deliver);
    processReady();
  });
}

void FrontEndNodelet::onColorInfo(const sensor_msgs::CameraInfoConstPtr& msg) {
  calibration_->addColorInfo(*msg);
  try {
    const CameraIntrinsics camera = intrinsicsFromCameraInfo(*msg, sensor_.topics.color);
    owner_->post(info_lane_, [this, t = msg->header.stamp.toSec(), camera] { focus_.add(t, camera); });
  } catch (const std::invalid_argument&) {
    // The calibration says what is wrong with it.
  }
}

void FrontEndNodelet::onColor(const std_msgs::Header& header, const std::function<cv::Mat()>& decode) {
  if (!watch(*color_monitor_, header)) return;
  calibration_->addColorFrame(header.frame_id);
  try {
    cv::Mat gray = decode();
    if (!gray_.note().empty()) NODELET_WARN_ONCE("topic %s: %s", color_source_.topic.c_str(), gray_.note().c_str());
    post(image_lane_, kColor, header,
         [this, gray, stamp = header.stamp.toNSec()](double t) { pairer_->addColor(t, gray, stamp); });
  } catch (const std::exception& error) {
    color_monitor_->reject(error.what());
    NODELET_WARN_THROTTLE(10, "topic %s: %s", color_monitor_->report().topic.c_str(), error.what());
  }
}

void FrontEndNodelet::onDepth(const std_msgs::Header& header, const std::function<cv::Mat()>& decode) {
  if (!watch(*depth_monitor_, header)) return;
  try {
    cv::Mat depth = decode();
    empty_depth_ = holdsNoDepth(depth, sensor_.depth_noise) ? empty_depth_ + 1 : 0;
    post(depth_lane_, kDepth, header, [this, depth](double t) { pairer_->addDepth(t, depth); });
  } catch (const std::exception& error) {
    depth_monitor_->reject(error.what());
    NODELET_WARN_THROTTLE(10, "topic %s: %s", depth_monitor_->report().topic.c_str(), error.what());
  }
}

void FrontEndNodelet::onImu(const sensor_msgs::ImuConstPtr& msg) {
  if (!watch(*imu_monitor_, msg->header)) return;
  calibration_->addImuFrame(msg->header.frame_id);
  const Eigen::Vector3d gyro = fromMsg(msg->angular_velocity), accel = fromMsg(msg->linear_acceleration);
  post(imu_lane_, kGyro, msg->header, [this, gyro, accel](double t) { addInertial(t, gyro, accel); });
}

void FrontEndNodelet::onGyro(const sensor_msgs::ImuConstPtr& msg) {
  if (!watch(*imu_monitor_, msg->header)) return;
  calibration_->addImuFrame(msg->header.frame_id);
  const Eigen::Vector3d gyro = fromMsg(msg->angular_velocity);
  post(imu_lane_, kGyro, msg->header, [this, gyro](double t) { addInertial(t, gyro, std::nullopt); });
}

void FrontEndNodelet::onAccel(const sensor_msgs::ImuConstPtr& msg) {
  if (!watch(sensor_.hasGyro() ? *accel_monitor_ : *imu_monitor_, msg->header)) return;
  if (!sensor_.hasGyro()) calibration_->addImuFrame(msg->header.frame_id);
  const Eigen::Vector3d accel = fromMsg(msg->linear_acceleration);
  post(imu_lane_, kAccel, msg->header, [this, accel](double t) { addInertial(t, std::nullopt, accel); });
}

}  // namespace vip_slam
