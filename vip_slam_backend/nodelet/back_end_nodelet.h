// SPDX-License-Identifier: BSD-3-Clause
// The back end as a nodelet: keyframes and plane updates in; map updates, map->odom, paths, markers and services out.
// One thread owns the map; a global bundle adjustment runs in a thread of its own and its result is merged by the
// owner.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <tf2_ros/transform_broadcaster.h>
#include <vip_slam_msgs/BackEndStatistics.h>
#include <vip_slam_msgs/Calibration.h>
#include <vip_slam_msgs/Control.h>
#include <vip_slam_msgs/Keyframe.h>
#include <vip_slam_msgs/PlaneUpdate.h>
#include <vip_slam_msgs/TrackedFrame.h>

#include "map_display.h"
#include "pose_in_map.h"
#include "reset_barrier.h"
#include "vip_slam_backend/BackEndConfig.h"
#include "vip_slam_backend/back_end.h"
#include "vip_slam_backend/back_end_node_options.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_ros/drop_watch.h"
#include "vip_slam_ros/output_monitor.h"
#include "vip_slam_ros/owner_thread.h"
#include "vip_slam_ros/tf_rivals.h"

namespace vip_slam {

class BackEndNodelet : public nodelet::Nodelet {
 public:
  ~BackEndNodelet() override;

 private:
  void onInit() override;
  void advertise();
  void advertiseServices();
  void advertiseRtabmapServices(const std::string& prefix);  ///< services with the names and types of RTAB-Map
  void subscribe();
  void onReconfigure(vip_slam_backend::BackEndConfig& config);
  void onFrame(const vip_slam_msgs::TrackedFrame& frame);  ///< at image rate, in a callback thread

  // In the owner thread.
  void start(const vip_slam_msgs::Calibration& calibration);
  void addKeyframe(const vip_slam_msgs::Keyframe& msg);
  void applyPlaneUpdate(const vip_slam_msgs::PlaneUpdate& msg);
  void report(const std::vector<std::string>& refusals);
  void startGlobalBa();
  void distribute(const MapUpdate& update);
  void publishStatistics();
  void publishDisplay(double t, bool now);
  void command(std::uint8_t command);

  /// Runs work in the owner thread; false, with the reason as message, when it throws or has to wait too long.
  bool askOwner(const std::function<std::string()>& work, std::string* message);
  /// Offers a service whose work runs in the owner thread; the answer is its return value or its exception's message.
  template <class Service>
  void offer(const std::string& name, const std::function<std::string(const typename Service::Request&)>& work);
  /// The same for std_srvs/Empty: the call itself fails when the work does, the message goes to the log.
  void offerEmpty(const std::string& name, const std::function<std::string()>& work);
  std::string reset(bool keep_map);
  std::string loadMap(const std::string& path);
  std::string saveMap(const std::string& path);
  std::string saveTrajectory(const std::string& path);
  std::string setLocalisation(bool on);
  BackEnd& backEnd();  ///< throws while there is none

  void report(diagnostic_updater::DiagnosticStatusWrapper& status);
  std::string tfRival() const;  ///< who else publishes map -> odom; empty when nobody, or when we do not

  BackEndNodeOptions options_;
  SensorConfig sensor_;
  PoseInMap pose_;
  ResetBarrier barrier_;

  // Owned by the thread.
  std::unique_ptr<BackEnd> back_end_;
  std::uint64_t planes_session_ = 0;  ///< of the plane nodelet, see PlaneUpdate
  std::uint64_t planes_wanted_ = 0;   ///< value of PlaneUpdate::restored from which on updates are applied; 0: any
  MapDisplay display_;
  double last_display_ = -1e300;  ///< stamp; negative before the first
  bool localise_ = false;         ///< requested mode, also before there is a back end
  bool adjusting_ = false;        ///< a global adjustment is under way
  std::thread adjustment_;

  std::unique_ptr<TfRivals> rivals_;
  DropWatch drops_, refusals_;  ///< used by diagnostics only
  mutable std::mutex shown_mutex_;
  vip_slam_msgs::BackEndStatistics shown_;
  std::string problem_;
  std::size_t refused_ = 0;                           ///< keyframes, planes and observations
  std::string last_refusal_;                          ///< why
  std::vector<std::string> calibration_differences_;  ///< messages; empty ones are not shown
  std::string load_problem_;                          ///< why the initial map could not be loaded
  vip_slam_backend::BackEndConfig config_;            ///< as last set by dynamic_reconfigure

  std::atomic<double> display_rate_{2.0};
  std::atomic<bool> publish_tf_{true};
  OwnerThread::Lane keyframe_lane_ = 0, update_lane_ = 0, control_lane_ = 0, adjustment_lane_ = 0;
  std::unique_ptr<tf2_ros::TransformBroadcaster> tf_broadcaster_;
  ros::Publisher map_update_pub_, control_pub_, pose_pub_, path_pub_, markers_pub_, landmarks_pub_, loop_pub_,
      statistics_pub_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  std::unique_ptr<OutputMonitor> pose_monitor_;
  boost::recursive_mutex reconfigure_mutex_;  ///< a service changes the configuration as well
  std::unique_ptr<dynamic_reconfigure::Server<vip_slam_backend::BackEndConfig>> reconfigure_;
  ros::WallTimer timer_;
  std::unique_ptr<OwnerThread> owner_;  ///< last member: stops before anything it uses is destroyed
};

}  // namespace vip_slam
