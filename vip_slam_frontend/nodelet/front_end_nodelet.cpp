// SPDX-License-Identifier: BSD-3-Clause
#include "front_end_nodelet.h"

#include <image_transport/image_transport.h>
#include <vip_slam_msgs/Calibration.h>
#include <vip_slam_msgs/Keyframe.h>
#include <vip_slam_msgs/TrackedFrame.h>
#include <vip_slam_msgs/TrackingStatus.h>
#include <pluginlib/class_list_macros.hpp>

#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/map_conversions.h"
#include "vip_slam_ros/parameters.h"
#include "vip_slam_ros/sensor_files.h"
#include "vip_slam_ros/stream_faults.h"

namespace vip_slam {

FrontEndNodelet::~FrontEndNodelet() {
  timer_.stop();
  rivals_.reset();
  color_images_.reset();
  depth_images_.reset();
  for (auto& subscriber : subscribers_) subscriber.shutdown();
  if (owner_) owner_->stop();
}

void FrontEndNodelet::onInit() {
  try {
    loadOptionsFromParameters(options_, getPrivateNodeHandle(), {"feature_image_rate", "diagnostic_period", "session"});
    std::vector<std::string> notes;
    sensor_ = loadSensorConfig(resolveSensor(options_.sensor), &notes);
    for (const std::string& note : notes) NODELET_WARN("%s", note.c_str());
    const std::vector<std::string> installed = installedTransports(getNodeHandle());
    color_source_ =
        chooseTransport(sensor_.topics.color, sensor_.color_encoding, options_.image_transport, false, installed);
    depth_source_ =
        chooseTransport(sensor_.topics.depth, sensor_.depth_encoding, options_.depth_image_transport, true, installed);
  } catch (const std::exception& error) {
    NODELET_FATAL("%s", error.what());
    throw;
  }
  // A nodelet that is unloaded and comes back finds what the one before has left on the parameter server.
  getPrivateNodeHandle().param("session", session_, 0);
  getPrivateNodeHandle().setParam("session", session_ + 1);
  if (session_ > 0)
    NODELET_WARN("the front end is started again: of a map that the back end still has its odometry is a new part");
  frames_.odom = options_.odom_frame;
  frames_.base = options_.base_frame;
  PairerOptions pairing;
  pairing.tolerance = options_.input.pair_tolerance;
  pairing.patience = sensor_.topics.depth.empty() ? -1.0 : options_.input.depth_patience;
  pairing.capacity = std::size_t(options_.image_queue);
  pairer_ = std::make_unique<ImagePairer>(pairing);
  time_ = std::make_unique<StreamTime>(kStreams, options_.input.time_jump,
                                       StreamTime::Listener{[this](const ClockStep& step) { clockWasSet(step); },
                                                            [this](double seconds) { timeRanBack(seconds); }});
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  tf_broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
  calibration_ = std::make_unique<CalibrationSource>(withResolvedTopics(), options_, tf_buffer_);
  rivals_ = std::make_unique<TfRivals>(options_.odom_frame, options_.base_frame, ros::this_node::getName());

  owner_ = std::make_unique<OwnerThread>([this](const std::string& what) { NODELET_ERROR("%s", what.c_str()); });
  imu_lane_ = owner_->addLane("imu", 4000);
  info_lane_ = owner_->addLane("camera_info", 1000);
  image_lane_ = owner_->addLane("color", std::size_t(options_.image_queue));
  depth_lane_ = owner_->addLane("depth", std::size_t(options_.image_queue));
  control_lane_ = owner_->addLane("control", 1000);
  advertise();
  owner_->start();
  subscribe();
  timer_ = getMTNodeHandle().createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { tick(); });
}

void FrontEndNodelet::advertise() {
  ros::NodeHandle& nh = getNodeHandle();
  odometry_pub_ = nh.advertise<nav_msgs::Odometry>("odom", 50);
  imu_rate_pub_ = nh.advertise<nav_msgs::Odometry>("odom_imu_rate", 400);
  frame_pub_ = nh.advertise<vip_slam_msgs::TrackedFrame>("tracked_frame", 20);
  keyframe_pub_ = nh.advertise<vip_slam_msgs::Keyframe>("keyframe", 20);
  status_pub_ = nh.advertise<vip_slam_msgs::TrackingStatus>("tracking_status", 5, true);
  feature_image_pub_ = image_transport::ImageTransport(nh).advertise("feature_image", 2);
  calibration_pub_ = nh.advertise<vip_slam_msgs::Calibration>("calibration", 1, true);

  diagnostics_ = std::make_unique<diagnostic_updater::Updater>(nh, getPrivateNodeHandle(), getName());
  diagnostics_->setHardwareID(sensor_.name);
  diagnostics_->add("tracking", this, &FrontEndNodelet::reportTracking);
  diagnostics_->add("input", this, &FrontEndNodelet::reportInput);
  diagnostics_->add("queues", this, &FrontEndNodelet::reportQueues);
  diagnostics_->add("tf", this, &FrontEndNodelet::reportTf);
  odometry_monitor_ = std::make_unique<OutputMonitor>("odom", sensor_.color_rate, diagnostics_.get());

  // The parameters given at the start are the initial values; dynamic_reconfigure would overwrite them by its defaults.
  ros::NodeHandle& private_nh = getPrivateNodeHandle();
  private_nh.setParam("publish_tf", options_.publish_tf);
  private_nh.setParam("imu_rate_odometry", options_.imu_rate_odometry);
  reconfigure_ = std::make_unique<dynamic_reconfigure::Server<vip_slam_frontend::FrontEndConfig>>(private_nh);
  reconfigure_->setCallback(
      [this](vip_slam_frontend::FrontEndConfig& config, std::uint32_t) { onReconfigure(config); });
}

void FrontEndNodelet::onMapUpdate(const vip_slam_msgs::MapUpdateConstPtr& msg) {
  owner_->post(control_lane_, [this, msg] {
    if (front_end_) front_end_->applyMapUpdate(fromMsg(*msg));
  });
}

void FrontEndNodelet::onControl(const vip_slam_msgs::ControlConstPtr& msg) {
  owner_->post(control_lane_, [this, command = msg->command] {
    using vip_slam_msgs::Control;
    if (command == Control::PAUSE) paused_ = true;
    const bool resumed = command == Control::RESUME && paused_;
    if (command == Control::RESUME) paused_ = false;
    if (command == Control::RESET || command == Control::RESET_ODOMETRY || resumed) {
      pairer_->clear();
      if (front_end_) front_end_->reset(resumed ? "resumed after a pause" : "reset by request");
      if (front_end_ && command == Control::RESET) front_end_->forgetMap();
    }
  });
}

void FrontEndNodelet::onReconfigure(vip_slam_frontend::FrontEndConfig& config) {
  publish_tf_ = config.publish_tf;
  imu_rate_odometry_ = config.imu_rate_odometry;
  feature_image_rate_ = config.feature_image_rate;
}

void FrontEndNodelet::clockWasSet(const ClockStep& step) {
  NODELET_WARN("%s", vip_slam::clockWasSet(step, step.stream ? monitor(*step.stream).report().topic : "").c_str());
  std::lock_guard<std::mutex> lock(shown_mutex_);
  ++shown_.clock_steps;
}

void FrontEndNodelet::timeRanBack(double seconds) {
  const std::string words = vip_slam::timeRanBack(seconds);
  NODELET_WARN("%s: the odometry starts anew, the map stays", words.c_str());
  pairer_->clear();
  early_.clear();
  for (auto* monitor : {color_monitor_.get(), depth_monitor_.get(), imu_monitor_.get(), accel_monitor_.get()}) {
    monitor->restart();
  }
  if (front_end_) front_end_->clockRanBack(words);
  last_feature_image_ = posed_imu_t_ = predicted_imu_t_ = -1e300;
  std::lock_guard<std::mutex> lock(shown_mutex_);
  ++shown_.time_jumps;
}

void FrontEndNodelet::addInertial(double t, const Vector& gyro, const Vector& accel) {
  if (front_end_) return feedInertial(t, gyro, accel);
  constexpr std::size_t kEarly = 4000;
  // Their times have been settled already: when replayed later they must not count as a jump back.
  early_.push_back([this, t, gyro, accel] { feedInertial(t, gyro, accel); });
  if (early_.size() > kEarly) early_.pop_front();
  startWhenCalibrated();
}

void FrontEndNodelet::feedInertial(double t, const Vector& gyro, const Vector& accel) {
  if (gyro && accel) {
    front_end_->addImu({t, *gyro, *accel});
  } else if (gyro) {
    front_end_->addGyro(t, *gyro);
  } else {
    front_end_->addAccel(t, *accel);
  }
  if (front_end_->counters().imu_spikes > 0 && !told_of_spikes_) {
    told_of_spikes_ = true;
    NODELET_WARN(
        "topic %s: a single sample just before %.3f s was far off its neighbours and was replaced by them (errors on "
        "its bus?); further ones are counted in /diagnostics",
        monitor(gyro ? kGyro : kAccel).report().topic.c_str(), t);
  }
  processReady();
  if (gyro && imu_rate_odometry_) publishImuRate(t);
}

const StreamMonitor& FrontEndNodelet::monitor(std::size_t stream) const {
  if (stream == kColor) return *color_monitor_;
  if (stream == kDepth) return *depth_monitor_;
  return stream == kGyro || !sensor_.hasGyro() ? *imu_monitor_ : *accel_monitor_;
}

void FrontEndNodelet::startWhenCalibrated() {
  const std::optional<SensorConfig> resolved = calibration_->resolve(time_->newest());
  if (!resolved) return;
  try {
    // time_ has already settled the stamps; those that pass are no jump.
    auto front_end = std::make_unique<FrontEnd>(options_.front_end, *resolved, nullptr, options_.input.time_jump,
                                                std::uint32_t(session_));
    alignment_ = std::make_unique<DepthAlignment>(*resolved);
    focus_.start(resolved->camera);
    front_end_ = std::move(front_end);
  } catch (const std::exception& error) {
    const std::string problem = "sensor '" + sensor_.name + "': " + error.what();
    NODELET_ERROR_THROTTLE(5, "%s", problem.c_str());
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.start_problem = problem;
    return;
  }
  const std::string origin = calibration_->extrinsicsOrigin();
  if (calibration_->tfIsIncomplete())
    NODELET_WARN("%s", origin.c_str());
  else
    NODELET_INFO("%s", origin.c_str());
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.start_problem.clear();
    shown_.extrinsics = origin;
  }
  // Only these fields are resolved here; the rest of sensor_ is read by other threads.
  sensor_.camera = resolved->camera;
  sensor_.depth_camera = resolved->depth_camera;
  sensor_.T_imu_cam = resolved->T_imu_cam;
  sensor_.T_base_imu = resolved->T_base_imu;
  frames_.T_base_imu = sensor_.T_base_imu;
  publishCalibration();
  const auto early = std::move(early_);
  early_.clear();
  for (const auto& add : early) add();
}

double FrontEndNodelet::waitedFor(double t) const {
  const double images = std::max(time_->newest(kColor), time_->newest(kDepth));
  const double imu = std::max(time_->newest(kGyro), time_->newest(kAccel));
  return std::max(images - t, imu - (t + front_end_->timeOffset()));
}

void FrontEndNodelet::processReady() {
  if (!front_end_) startWhenCalibrated();
  if (!front_end_) return;
  while (const ImagePair* front = pairer_->front()) {
    if (!front_end_->ready(front->t, front->depth_lag) && waitedFor(front->t) <= options_.input.imu_patience) return;
    // Removed before processing: an image that throws must not be tried again forever.
    ImagePair pair = *front;
    pairer_->pop();
    process(std::move(pair));
  }
}

void FrontEndNodelet::process(ImagePair pair) {
  focus_.apply(sensor_.depth_registered, &pair);
  if (focus_.warped() > 0) NODELET_WARN_ONCE("topic %s: %s", sensor_.topics.color_info.c_str(), focus_.words().c_str());
  std::string size_problem;
  const FrameInput input{pair.t, pair.gray, alignment_->align(pair.depth, pair.gray.size(), &size_problem),
                         pair.depth_lag};
  if (!size_problem.empty()) NODELET_WARN_THROTTLE(10, "%s", size_problem.c_str());
  const ros::Time stamp = ros::Time().fromNSec(pair.stamp);
  const ros::WallTime begin = ros::WallTime::now();
  bool posed = false;
  const FrameOutput output = front_end_->process(input, [&](const TrackedFrame& frame) {
    publishPose(stamp, frame);
    posed = true;
  });
  if (!posed) publishPose(stamp, *output.frame);
  const double milliseconds = (ros::WallTime::now() - begin).toSec() * 1e3;
  publish(pair, output, milliseconds);

  constexpr std::uint64_t kRenewCalibration = 30;  // images: its sigmas cost an inversion
  std::optional<CalibrationEstimate> calibration;
  if (front_end_->counters().images % kRenewCalibration == 0) calibration = front_end_->calibration();

  std::lock_guard<std::mutex> lock(shown_mutex_);
  if (calibration) {
    shown_.calibration = *calibration;
    shown_.calibration_differences = front_end_->counters().imuIsWrong()
                                         ? std::vector<std::string>()
                                         : calibrationDifferences(front_end_->givenCalibration(), *calibration);
  }
  shown_.size_problem = size_problem;
  shown_.status = output.frame->status;
  shown_.counters = front_end_->counters();
  shown_.pairs = pairer_->counters();
  shown_.ahead = shown_.stray = 0;
  for (std::size_t stream = 0; stream < kStreams; ++stream) {
    shown_.ahead += time_->leftOut(stream).ahead;
    shown_.stray += time_->leftOut(stream).stray;
  }
  shown_.features = output.frame->features.size();
  shown_.latency = (ros::Time::now() - stamp).toSec();
  shown_.processing = milliseconds;
  constexpr std::size_t kRecent = 1200;
  shown_.recent.push_back(milliseconds);
  if (shown_.recent.size() > kRecent) shown_.recent.pop_front();
}

}  // namespace vip_slam

PLUGINLIB_EXPORT_CLASS(vip_slam::FrontEndNodelet, nodelet::Nodelet)
