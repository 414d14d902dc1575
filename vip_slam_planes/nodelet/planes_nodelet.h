// SPDX-License-Identifier: BSD-3-Clause
// The plane module as a nodelet: keyframes, tracked frames and map updates in; plane updates, the plane map, rviz
// markers and a cloud out. One thread owns the estimator.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <vip_slam_msgs/Calibration.h>
#include <vip_slam_msgs/Control.h>
#include <vip_slam_msgs/Keyframe.h>
#include <vip_slam_msgs/MapUpdate.h>
#include <vip_slam_msgs/TrackedFrame.h>

#include "plane_display.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_planes/PlanesConfig.h"
#include "vip_slam_planes/plane_mapper.h"
#include "vip_slam_planes/planes_node_options.h"
#include "vip_slam_ros/drop_watch.h"
#include "vip_slam_ros/owner_thread.h"

namespace vip_slam {

class PlanesNodelet : public nodelet::Nodelet {
 public:
  ~PlanesNodelet() override;

 private:
  void onInit() override;
  void onReconfigure(vip_slam_planes::PlanesConfig& config);

  // In the owner thread.
  void start(const vip_slam_msgs::Calibration& calibration);
  void applyMapUpdate(const vip_slam_msgs::MapUpdate& msg);
  void grow(const vip_slam_msgs::TrackedFrame& msg);
  void obey(const vip_slam_msgs::Control& control);
  void publishMap(double t, bool now);

  void report(diagnostic_updater::DiagnosticStatusWrapper& status);

  PlanesNodeOptions options_;
  SensorConfig sensor_;

  // Owned by the thread.
  std::unique_ptr<PlaneMapper> mapper_;
  PlaneDisplay display_;
  vip_slam_msgs::ControlConstPtr early_map_;  ///< a map that was loaded before the calibration was received
  SE3 T_map_odom_;
  std::uint32_t epoch_ = 0;
  bool placed_ = false;  ///< T_map_odom_ is known for epoch_
  std::uint64_t revision_ = 0;
  std::uint64_t session_ = 0, restored_ = 0;  ///< see PlaneUpdate
  double last_display_ = -1e300;              ///< stamp; negative before the first

  struct Shown {
    PlaneMapperCounters counters;
    std::size_t planes = 0, points = 0;
    double update_ms = 0, growth_ms = 0;
  };
  DropWatch drops_;  ///< used by diagnostics only
  mutable std::mutex shown_mutex_;
  Shown shown_;

  std::atomic<double> opacity_{0.45}, cloud_voxel_{0.03}, display_rate_{2.0};
  OwnerThread::Lane frame_lane_ = 0, keyframe_lane_ = 0, update_lane_ = 0, control_lane_ = 0;
  ros::Publisher update_pub_, map_pub_, markers_pub_, cloud_pub_;
  std::vector<ros::Subscriber> subscribers_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  std::unique_ptr<dynamic_reconfigure::Server<vip_slam_planes::PlanesConfig>> reconfigure_;
  ros::WallTimer timer_;
  std::unique_ptr<OwnerThread> owner_;  ///< last member: stops before anything it uses is destroyed
};

}  // namespace vip_slam
