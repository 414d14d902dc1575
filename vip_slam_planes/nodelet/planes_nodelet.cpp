// SPDX-License-Identifier: BSD-3-Clause
#include "planes_nodelet.h"

#include <vip_slam_msgs/PlaneMap.h>
#include <vip_slam_msgs/PlaneUpdate.h>
#include <pluginlib/class_list_macros.hpp>

#include "vip_slam_ros/calibration.h"
#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/map_conversions.h"
#include "vip_slam_ros/parameters.h"
#include "vip_slam_ros/plane_conversions.h"
#include "vip_slam_ros/sensor_files.h"
#include "vip_slam_ros/thread_priority.h"

namespace vip_slam {

using diagnostic_msgs::DiagnosticStatus;

PlanesNodelet::~PlanesNodelet() {
  timer_.stop();
  for (auto& subscriber : subscribers_) subscriber.shutdown();
  // Their callbacks use the owner thread too.
  reconfigure_.reset();
  markers_pub_.shutdown();
  cloud_pub_.shutdown();
  if (owner_) owner_->stop();
}

void PlanesNodelet::onInit() {
  try {
    loadOptionsFromParameters(options_, getPrivateNodeHandle(),
                              {"opacity", "cloud_voxel", "display_rate", "diagnostic_period"});
    sensor_ = loadSensorConfig(resolveSensor(options_.sensor));
  } catch (const std::exception& error) {
    NODELET_FATAL("%s", error.what());
    throw;
  }
  owner_ = std::make_unique<OwnerThread>([this](const std::string& what) { NODELET_ERROR("%s", what.c_str()); });
  session_ = ros::WallTime::now().toNSec();
  frame_lane_ = owner_->addLane("tracked frames", 5);  // growth may skip images
  keyframe_lane_ = owner_->addLane("keyframes", std::size_t(options_.keyframe_queue));
  update_lane_ = owner_->addLane("map updates", std::size_t(options_.keyframe_queue));
  control_lane_ = owner_->addLane("control", 100);

  ros::NodeHandle& nh = getNodeHandle();
  update_pub_ = nh.advertise<vip_slam_msgs::PlaneUpdate>("plane_update", 1000);  // incremental: none may be lost
  map_pub_ = nh.advertise<vip_slam_msgs::PlaneMap>("plane_map", 1, true);
  // Computed only while there are subscribers; a new one gets the present map even if it no longer changes.
  const auto show = [this](const ros::SingleSubscriberPublisher&) {
    owner_->post(control_lane_, [this] {
      if (last_display_ >= 0) publishMap(last_display_, true);
    });
  };
  markers_pub_ = nh.advertise<visualization_msgs::MarkerArray>("plane_markers", 1, show, {}, nullptr, true);
  cloud_pub_ = nh.advertise<sensor_msgs::PointCloud2>("plane_cloud", 1, show, {}, nullptr, true);
  diagnostics_ = std::make_unique<diagnostic_updater::Updater>(nh, getPrivateNodeHandle(), getName());
  diagnostics_->setHardwareID(sensor_.name);
  diagnostics_->add("planes", this, &PlanesNodelet::report);
  reconfigure_ = std::make_unique<dynamic_reconfigure::Server<vip_slam_planes::PlanesConfig>>(getPrivateNodeHandle());
  reconfigure_->setCallback([this](vip_slam_planes::PlanesConfig& config, std::uint32_t) { onReconfigure(config); });
  owner_->start(kMappingNiceness);

  // One ordered callback queue: a keyframe is delivered before the update that places it.
  subscribers_.push_back(nh.subscribe<vip_slam_msgs::Calibration>(
      "calibration", 1,
      [this](const vip_slam_msgs::CalibrationConstPtr& m) { owner_->post(control_lane_, [this, m] { start(*m); }); }));
  subscribers_.push_back(
      nh.subscribe<vip_slam_msgs::Keyframe>("keyframe", 50, [this](const vip_slam_msgs::KeyframeConstPtr& m) {
        const bool kept = owner_->post(keyframe_lane_, [this, m] {
          if (mapper_) mapper_->addKeyframe(std::make_shared<const Keyframe>(fromMsg(*m)));
        });
        if (!kept) {
          NODELET_WARN_THROTTLE(5,
                                "the planes are too slow: the oldest of %d waiting keyframes was dropped "
                                "(keyframe_queue)",
                                options_.keyframe_queue);
        }
      }));
  subscribers_.push_back(nh.subscribe<vip_slam_msgs::TrackedFrame>(
      "tracked_frame", 20,
      [this](const vip_slam_msgs::TrackedFrameConstPtr& m) { owner_->post(frame_lane_, [this, m] { grow(*m); }); }));
  subscribers_.push_back(
      nh.subscribe<vip_slam_msgs::MapUpdate>("map_update", 50, [this](const vip_slam_msgs::MapUpdateConstPtr& m) {
        if (!owner_->post(update_lane_, [this, m] { applyMapUpdate(*m); })) {
          NODELET_WARN_THROTTLE(5,
                                "the planes are too slow: the oldest of %d waiting map updates was dropped "
                                "(keyframe_queue)",
                                options_.keyframe_queue);
        }
      }));
  subscribers_.push_back(
      nh.subscribe<vip_slam_msgs::Control>("control", 20, [this](const vip_slam_msgs::ControlConstPtr& m) {
        owner_->post(control_lane_, [this, m] {
          if (mapper_) {
            obey(*m);
          } else if (m->command == vip_slam_msgs::Control::MAP_LOADED) {
            early_map_ = m;
          } else if (m->command == vip_slam_msgs::Control::RESET) {
            early_map_.reset();
          }
        });
      }));
  timer_ = getMTNodeHandle().createWallTimer(ros::WallDuration(1.0),
                                             [this](const ros::WallTimerEvent&) { diagnostics_->force_update(); });
}

void PlanesNodelet::onReconfigure(vip_slam_planes::PlanesConfig& config) {
  opacity_ = config.opacity;
  cloud_voxel_ = config.cloud_voxel;
  display_rate_ = config.display_rate;
}

void PlanesNodelet::start(const vip_slam_msgs::Calibration& calibration) {
  if (mapper_) return;  // the front end restarted with the same sensor
  applyCalibration(calibration, &sensor_);
  mapper_ = std::make_unique<PlaneMapper>(options_.mapper, makeCamera(sensor_.camera), sensor_.depth_noise);
  if (early_map_) obey(*early_map_);
  early_map_.reset();
}

void PlanesNodelet::grow(const vip_slam_msgs::TrackedFrame& msg) {
  if (!mapper_ || !placed_ || msg.epoch != epoch_) return;
  const TrackedFrame frame = fromMsg(msg);
  const ros::WallTime begin = ros::WallTime::now();
  const std::uint64_t grown = mapper_->counters().frames_grown;
  mapper_->grow(frame, T_map_odom_);
  if (mapper_->counters().frames_grown == grown) return;
  const double milliseconds = (ros::WallTime::now() - begin).toSec() * 1e3;
  std::lock_guard<std::mutex> lock(shown_mutex_);
  shown_.growth_ms = milliseconds;
}

void PlanesNodelet::applyMapUpdate(const vip_slam_msgs::MapUpdate& msg) {
  if (!mapper_) return;
  const MapUpdate map = fromMsg(msg);
  T_map_odom_ = map.T_map_odom;
  epoch_ = map.epoch;
  placed_ = map.newest_keyframe != 0;
  revision_ = map.revision;
  const ros::WallTime begin = ros::WallTime::now();
  const PlaneUpdate update = mapper_->applyMapUpdate(map);
  const double milliseconds = (ros::WallTime::now() - begin).toSec() * 1e3;
  auto told = boost::make_shared<vip_slam_msgs::PlaneUpdate>(toMsg(update, options_.map_frame));
  told->session = session_;
  told->restored = restored_;
  update_pub_.publish(told);
  display_.apply(map);
  display_.apply(update);
  publishMap(map.t, map.global);

  std::lock_guard<std::mutex> lock(shown_mutex_);
  shown_.counters = mapper_->counters();
  shown_.planes = mapper_->planes().size();
  shown_.points = display_.points();
  shown_.update_ms = milliseconds;
}

void PlanesNodelet::obey(const vip_slam_msgs::Control& control) {
  using vip_slam_msgs::Control;
  if (control.command == Control::RESET) {
    mapper_->clear();
    display_.clear();
    placed_ = false;
    publishMap(control.header.stamp.toSec(), true);
  } else if (control.command == Control::MAP_LOADED) {
    mapper_->restore(fromMsg(control.planes, control.hosts), control.newest_keyframe);
    restored_ = control.newest_keyframe;
    display_.clear();
    publishMap(control.header.stamp.toSec(), true);
  }
}

void PlanesNodelet::publishMap(double t, bool now) {
  map_pub_.publish(
      boost::make_shared<vip_slam_msgs::PlaneMap>(toPlaneMapMsg(mapper_->planes(), t, revision_, options_.map_frame)));
  if (!now && t > last_display_ && t - last_display_ < 1.0 / display_rate_) return;
  last_display_ = t;
  std_msgs::Header header;
  header.stamp = toStamp(t);
  header.frame_id = options_.map_frame;
  if (markers_pub_.getNumSubscribers() > 0) {  // the outline of a hall takes a tenth of a second to fill
    markers_pub_.publish(
        boost::make_shared<visualization_msgs::MarkerArray>(display_.markers(mapper_->planes(), header, opacity_)));
  }
  if (cloud_pub_.getNumSubscribers() > 0) {
    cloud_pub_.publish(boost::make_shared<sensor_msgs::PointCloud2>(display_.cloud(header, cloud_voxel_)));
  }
}

void PlanesNodelet::report(diagnostic_updater::DiagnosticStatusWrapper& status) {
  std::size_t dropped = 0;
  for (const auto& lane : owner_->lanes()) {
    status.add(lane.name + " waiting", lane.waiting);
    status.add(lane.name + " dropped", lane.dropped);
    // Growth skips images by design when there is no time for it.
    if (lane.name != "tracked frames") dropped += lane.dropped;
  }
  std::lock_guard<std::mutex> lock(shown_mutex_);
  const PlaneMapperCounters& c = shown_.counters;
  const bool drops = drops_.lately(dropped, ros::WallTime::now().toSec());
  status.summary(drops ? DiagnosticStatus::WARN : DiagnosticStatus::OK,
                 drops ? std::to_string(dropped) + " keyframes or map updates dropped"
                       : std::to_string(shown_.planes) + " planes");
  status.add("planes", shown_.planes);
  status.add("depth points on planes", shown_.points);
  status.add("last update (ms)", shown_.update_ms);
  status.add("last growth (ms)", shown_.growth_ms);
  status.add("keyframes processed", c.keyframes);
  status.add("keyframes waiting for their place", c.keyframes_waiting);
  status.add("keyframes never placed", c.keyframes_forgotten);
  status.add("images grown with", c.frames_grown);
  status.add("images skipped", c.frames_skipped);
  status.add("planes started", c.planes_started);
  status.add("planes merged", c.planes_merged);
  status.add("planes removed", c.planes_removed);
  status.add("points undecided", c.point_candidates);
  status.add("points associated", c.points_associated);
  status.add("points dissociated", c.points_dissociated);
}

}  // namespace vip_slam

PLUGINLIB_EXPORT_CLASS(vip_slam::PlanesNodelet, nodelet::Nodelet)
