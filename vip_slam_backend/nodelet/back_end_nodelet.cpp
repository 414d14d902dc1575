// SPDX-License-Identifier: BSD-3-Clause
#include "back_end_nodelet.h"

#include <fstream>
#include <stdexcept>
#include <system_error>

#include <vip_slam_msgs/LoopEvent.h>
#include <vip_slam_msgs/MapUpdate.h>
#include <pluginlib/class_list_macros.hpp>

#include "vip_slam_backend/optimisation/inertial_scale.h"
#include "vip_slam_ros/calibration.h"
#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/parameters.h"
#include "vip_slam_ros/plane_conversions.h"
#include "vip_slam_ros/sensor_files.h"
#include "vip_slam_ros/thread_priority.h"

namespace vip_slam {

constexpr int kMaxPlaneUpdates = 1000;

BackEndNodelet::~BackEndNodelet() {
  timer_.stop();
  rivals_.reset();
  for (auto& service : services_) service.shutdown();
  for (auto& subscriber : subscribers_) subscriber.shutdown();
  // Their callbacks use the owner thread too.
  reconfigure_.reset();
  markers_pub_.shutdown();
  landmarks_pub_.shutdown();
  if (owner_) owner_->stop();
  if (adjustment_.joinable()) adjustment_.join();
}

void BackEndNodelet::onInit() {
  try {
    loadOptionsFromParameters(options_, getPrivateNodeHandle(), {"display_rate", "diagnostic_period"});
    sensor_ = loadSensorConfig(resolveSensor(options_.sensor));
    if (!options_.load_map.empty() && !std::ifstream(options_.load_map))
      throw std::invalid_argument("load_map: " + options_.load_map + ": no such file, or not readable");
  } catch (const std::exception& error) {
    NODELET_FATAL("%s", error.what());
    throw;
  }
  publish_tf_ = options_.publish_tf;
  tf_broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
  rivals_ = std::make_unique<TfRivals>(options_.map_frame, options_.odom_frame, ros::this_node::getName());
  owner_ = std::make_unique<OwnerThread>([this](const std::string& what) {
    NODELET_ERROR("%s", what.c_str());
    std::lock_guard<std::mutex> lock(shown_mutex_);
    problem_ = what;
  });
  keyframe_lane_ = owner_->addLane("keyframes", std::size_t(options_.keyframe_queue));
  // Observations and associations are sent only once: the queue holds minutes of them.
  update_lane_ = owner_->addLane("plane updates", kMaxPlaneUpdates);
  control_lane_ = owner_->addLane("control", 100);
  adjustment_lane_ = owner_->addLane("adjustments", 2);  // its own lane: if an end were dropped, no other would start
  advertise();
  owner_->start(kMappingNiceness);
  advertiseServices();
  subscribe();
  timer_ = getMTNodeHandle().createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) {
    if (const std::string rival = tfRival(); !rival.empty()) NODELET_WARN_THROTTLE(10, "tf: %s", rival.c_str());
    diagnostics_->force_update();
  });
}

void BackEndNodelet::advertise() {
  ros::NodeHandle& nh = getNodeHandle();
  map_update_pub_ = nh.advertise<vip_slam_msgs::MapUpdate>("map_update", 20);
  control_pub_ = nh.advertise<vip_slam_msgs::Control>("control", 10, true);  // latched: other nodelets may start later
  pose_pub_ = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 50);
  path_pub_ = nh.advertise<nav_msgs::Path>("path", 1, true);
  // Computed only while there are subscribers; a new one gets the present map even if it no longer changes.
  const auto show = [this](const ros::SingleSubscriberPublisher&) {
    owner_->post(control_lane_, [this] {
      if (last_display_ >= 0) publishDisplay(last_display_, true);
    });
  };
  markers_pub_ = nh.advertise<visualization_msgs::MarkerArray>("map_markers", 1, show, {}, nullptr, true);
  landmarks_pub_ = nh.advertise<sensor_msgs::PointCloud2>("landmarks", 1, show, {}, nullptr, true);
  loop_pub_ = nh.advertise<vip_slam_msgs::LoopEvent>("loop_event", 20);
  statistics_pub_ = nh.advertise<vip_slam_msgs::BackEndStatistics>("back_end_statistics", 5, true);

  diagnostics_ = std::make_unique<diagnostic_updater::Updater>(nh, getPrivateNodeHandle(), getName());
  diagnostics_->setHardwareID(sensor_.name);
  diagnostics_->add("map", this, &BackEndNodelet::report);
  diagnostics_->add("tf", [this](diagnostic_updater::DiagnosticStatusWrapper& status) {
    const std::string rival = tfRival();
    status.summary(rival.empty() ? diagnostic_msgs::DiagnosticStatus::OK : diagnostic_msgs::DiagnosticStatus::WARN,
                   rival.empty() ? "no other source of '" + options_.odom_frame + "'" : rival);
  });
  pose_monitor_ = std::make_unique<OutputMonitor>("pose", sensor_.color_rate, diagnostics_.get());
  getPrivateNodeHandle().setParam("localisation_mode", options_.localisation_mode);
  reconfigure_ = std::make_unique<dynamic_reconfigure::Server<vip_slam_backend::BackEndConfig>>(reconfigure_mutex_,
                                                                                                getPrivateNodeHandle());
  reconfigure_->setCallback([this](vip_slam_backend::BackEndConfig& config, std::uint32_t) { onReconfigure(config); });
}

std::string BackEndNodelet::tfRival() const { return publish_tf_ ? rivals_->words(ros::WallTime::now().toSec()) : ""; }

void BackEndNodelet::subscribe() {
  ros::NodeHandle& nh = getNodeHandle();
  rivals_->listen(nh);
  subscribers_.push_back(nh.subscribe<vip_slam_msgs::Calibration>(
      "calibration", 1,
      [this](const vip_slam_msgs::CalibrationConstPtr& m) { owner_->post(control_lane_, [this, m] { start(*m); }); }));
  subscribers_.push_back(
      nh.subscribe<vip_slam_msgs::Keyframe>("keyframe", 50, [this](const vip_slam_msgs::KeyframeConstPtr& m) {
        if (!owner_->post(keyframe_lane_, [this, m] { addKeyframe(*m); })) {
          NODELET_WARN_THROTTLE(5,
                                "the back end is too slow: the oldest of %d waiting keyframes was dropped "
                                "(keyframe_queue)",
                                options_.keyframe_queue);
        }
      }));
  subscribers_.push_back(nh.subscribe<vip_slam_msgs::PlaneUpdate>(
      "plane_update", kMaxPlaneUpdates, [this](const vip_slam_msgs::PlaneUpdateConstPtr& m) {
        if (!owner_->post(update_lane_, [this, m] { applyPlaneUpdate(*m); })) {
          NODELET_WARN_THROTTLE(5,
                                "the back end is too slow: the oldest of %d waiting updates of the planes was dropped",
                                kMaxPlaneUpdates);
        }
      }));
  subscribers_.push_back(getMTNodeHandle().subscribe<vip_slam_msgs::TrackedFrame>(
      "tracked_frame", 50, [this](const vip_slam_msgs::TrackedFrameConstPtr& m) {
        try {
          onFrame(*m);
        } catch (const std::invalid_argument& error) {  // not on the owner thread, which would catch it
          NODELET_ERROR_THROTTLE(1, "tracked frame: %s", error.what());
        }
      }));
}

void BackEndNodelet::onReconfigure(vip_slam_backend::BackEndConfig& config) {
  display_rate_ = config.display_rate;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    config_ = config;
  }
  owner_->post(control_lane_, [this, on = config.localisation_mode] {
    localise_ = on;
    if (back_end_) setLocalisation(on);
  });
}

void BackEndNodelet::onFrame(const vip_slam_msgs::TrackedFrame& frame) {
  const double t = timeOf(frame);
  barrier_.see(t, frame.epoch);
  if (!hasPose(TrackingState(frame.status.state))) return;
  const SE3 T_odom_I = fromMsg(frame.state.pose);
  const Matrix15d covariance =
      Eigen::Map<const Eigen::Matrix<double, 15, 15, Eigen::RowMajor>>(frame.covariance.data());
  const std::optional<SE3> T_map_odom =
      pose_.add({t, frame.epoch, fromMsg(frame.chain_camera), velocitySigma(covariance)});
  if (!T_map_odom) return;
  if (publish_tf_) {
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = frame.header.stamp;
    transform.header.frame_id = options_.map_frame;
    transform.child_frame_id = options_.odom_frame;
    transform.transform = toTransformMsg(*T_map_odom);
    tf_broadcaster_->sendTransform(transform);
  }
  auto pose = boost::make_shared<geometry_msgs::PoseWithCovarianceStamped>(
      pose_.message(t, *T_map_odom, T_odom_I, covariance, options_.map_frame));
  pose->header.stamp = frame.header.stamp;  // exact, unlike the double t
  pose_pub_.publish(pose);
  pose_monitor_->published(frame.header.stamp);
}

void BackEndNodelet::start(const vip_slam_msgs::Calibration& calibration) {
  if (back_end_) return;  // the front end restarted with the same sensor
  applyCalibration(calibration, &sensor_);
  back_end_ = std::make_unique<BackEnd>(options_.back_end, sensor_);
  pose_.setBase(sensor_.T_base_imu);
  display_.setBase(sensor_.T_base_imu);
  if (!options_.load_map.empty()) {
    try {
      NODELET_INFO("%s", loadMap(options_.load_map).c_str());
    } catch (const std::exception& error) {
      NODELET_ERROR("%s: starting without a map", error.what());
      std::lock_guard<std::mutex> lock(shown_mutex_);
      load_problem_ = std::string(error.what()) + ": started without a map";
    }
  }
  if (localise_) setLocalisation(true);
}

void BackEndNodelet::addKeyframe(const vip_slam_msgs::Keyframe& msg) {
  const double t = timeOf(msg.frame);
  barrier_.seeKeyframe(t, msg.frame.epoch);
  if (!back_end_ || !barrier_.passes(t, msg.frame.epoch)) return;
  const auto keyframe = std::make_shared<const Keyframe>(fromMsg(msg));
  display_.addKeyframe(*keyframe);
  const ros::WallTime begin = ros::WallTime::now();
  const MapUpdate update = back_end_->addKeyframe(keyframe);
  const double milliseconds = (ros::WallTime::now() - begin).toSec() * 1e3;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.local_ms = milliseconds;
    problem_ = update.keyframes.empty() ? back_end_->lastRefusal() : "";
    // Until the new odometry is localised the updates still refer to the one before.
    const bool known = update.placed && update.epoch == keyframe->frame.epoch;
    if (problem_.empty() && !known && update.newest_keyframe != 0)
      problem_ = "the odometry began anew, and its place in the map is not found yet";
    calibration_differences_ = {scaleDifference(back_end_->scale(), sensor_), back_end_->depthDifference()};
  }
  report(back_end_->takeRefusals());
  for (const std::string& what : back_end_->takeNotices()) NODELET_WARN_THROTTLE(1, "%s", what.c_str());
  distribute(update);
  startGlobalBa();
}

void BackEndNodelet::applyPlaneUpdate(const vip_slam_msgs::PlaneUpdate& msg) {
  if (!back_end_) return;
  if (msg.session != planes_session_) {
    // A reloaded plane nodelet has no planes, and planes that its updates do not name would be removed.
    if (planes_session_ != 0 && !back_end_->map().planes().empty()) {
      NODELET_WARN("the plane nodelet began anew: it gets the planes of the map");
      planes_wanted_ = back_end_->map().newestKeyframe();
      command(vip_slam_msgs::Control::MAP_LOADED);
    }
    planes_session_ = msg.session;
  }
  if (planes_wanted_ != 0 && msg.restored != planes_wanted_) return;
  planes_wanted_ = 0;
  std::vector<std::string> unreadable;
  back_end_->applyPlaneUpdate(fromMsg(msg, &unreadable));
  report(unreadable);
  report(back_end_->takeRefusals());
}

void BackEndNodelet::report(const std::vector<std::string>& refusals) {
  for (const std::string& reason : refusals) {
    NODELET_WARN_THROTTLE(1, "refused: %s", reason.c_str());
    std::lock_guard<std::mutex> lock(shown_mutex_);
    ++refused_;
    last_refusal_ = reason;
  }
}

void BackEndNodelet::startGlobalBa() {
  if (adjusting_ || !back_end_ || !back_end_->globalBaWanted()) return;
  if (adjustment_.joinable()) adjustment_.join();
  const auto adjust = [this, job = back_end_->startGlobalBa()] {
    lowerThreadPriority(kAdjustmentNiceness);
    const ros::WallTime begin = ros::WallTime::now();
    GbaResult result;
    std::string failure;
    try {
      result = back_end_->run(job);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    const double milliseconds = (ros::WallTime::now() - begin).toSec() * 1e3;
    owner_->post(adjustment_lane_, [this, result, failure, milliseconds] {
      adjusting_ = false;
      if (!failure.empty()) {
        back_end_->requestGlobalBa();  // the request is still open
        throw std::runtime_error("global adjustment: " + failure);
      }
      {
        std::lock_guard<std::mutex> lock(shown_mutex_);
        shown_.global_ms = milliseconds;
        ++shown_.global_adjustments;
      }
      distribute(back_end_->merge(result));
      startGlobalBa();  // if requested meanwhile: there may be no further keyframe to start it
    });
  };
  try {
    adjustment_ = std::thread(adjust);
  } catch (const std::system_error&) {  // no thread available: the next keyframe tries again
    back_end_->requestGlobalBa();
    throw;
  }
  adjusting_ = true;  // safe after the start: the end is posted to this same thread
}

}  // namespace vip_slam

PLUGINLIB_EXPORT_CLASS(vip_slam::BackEndNodelet, nodelet::Nodelet)
