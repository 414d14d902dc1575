// SPDX-License-Identifier: BSD-3-Clause
// The front end as a nodelet: subscribers decode and queue messages, one thread owns the estimator and publishes.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <image_transport/publisher.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Imu.h>
#include <std_msgs/Header.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#include <vip_slam_msgs/Control.h>
#include <vip_slam_msgs/MapUpdate.h>

#include "calibration_source.h"
#include "depth_alignment.h"
#include "odometry_messages.h"
#include "vip_slam_frontend/FrontEndConfig.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/front_end_node_options.h"
#include "vip_slam_ros/constant_focus.h"
#include "vip_slam_ros/drop_watch.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/image_pairer.h"
#include "vip_slam_ros/image_subscriber.h"
#include "vip_slam_ros/output_monitor.h"
#include "vip_slam_ros/owner_thread.h"
#include "vip_slam_ros/stream_monitor.h"
#include "vip_slam_ros/stream_time/stream_time.h"
#include "vip_slam_ros/tf_rivals.h"

namespace vip_slam {

class FrontEndNodelet : public nodelet::Nodelet {
 public:
  ~FrontEndNodelet() override;

 private:
  void onInit() override;
  void advertise();
  void subscribe();
  std::string resolved(const std::string& topic) const;  ///< by the remappings of the node; empty stays empty
  SensorConfig withResolvedTopics() const;               ///< sensor_, with the names that a user sees in the graph

  // In the callback threads: decoding, stream monitoring, queuing.
  void onColor(const std_msgs::Header& header, const std::function<cv::Mat()>& decode);
  void onDepth(const std_msgs::Header& header, const std::function<cv::Mat()>& decode);
  void onImu(const sensor_msgs::ImuConstPtr& msg);
  void onGyro(const sensor_msgs::ImuConstPtr& msg);
  void onAccel(const sensor_msgs::ImuConstPtr& msg);
  void onMapUpdate(const vip_slam_msgs::MapUpdateConstPtr& msg);
  void onControl(const vip_slam_msgs::ControlConstPtr& msg);
  void onReconfigure(vip_slam_frontend::FrontEndConfig& config);
  void onColorInfo(const sensor_msgs::CameraInfoConstPtr& msg);
  bool watch(StreamMonitor& monitor, const std_msgs::Header& header);  ///< false: leave the message out
  enum Stream { kColor, kDepth, kGyro, kAccel, kStreams };
  /// Has a message wait in its lane until the owner's thread takes it with its time.
  void post(OwnerThread::Lane lane, Stream stream, const std_msgs::Header& header, StreamTime::Deliver deliver);

  // In the owner thread.
  using Vector = std::optional<Eigen::Vector3d>;
  void addInertial(double t, const Vector& gyro, const Vector& accel);
  void feedInertial(double t, const Vector& gyro, const Vector& accel);  ///< with an estimator
  void clockWasSet(const ClockStep& step);
  void timeRanBack(double seconds);
  const StreamMonitor& monitor(std::size_t stream) const;
  void startWhenCalibrated();
  void processReady();
  /// Time by which other streams have advanced past an image at `t`, each by its own stamps; seconds.
  double waitedFor(double t) const;
  void process(ImagePair pair);
  /// Odometry and tf of a frame that has a pose.
  void publishPose(const ros::Time& stamp, const TrackedFrame& frame);
  void publish(const ImagePair& pair, const FrameOutput& output, double milliseconds);
  void publishFeatureImage(const ImagePair& pair, const TrackedFrame& frame);
  void publishImuRate(double t);
  void publishCalibration();

  // Diagnostics, once a second by the wall clock.
  void tick();
  /// A subscribed topic's monitor and its expected message type.
  struct Input {
    StreamMonitor* monitor;
    std::string type;
  };
  std::vector<Input> inputs() const;
  bool splitImu() const { return !sensor_.topics.gyro.empty() && !sensor_.topics.accel.empty(); }
  void lookUpTopics();          ///< asks the ROS master why topics have no messages, and who publishes them
  std::string tfRival() const;  ///< who else publishes odom -> base_link; empty when nobody, or when we do not
  std::string depthAbsence(double now) const;  ///< empty while usable depth comes, and for sensors without
  void reportTracking(diagnostic_updater::DiagnosticStatusWrapper& status);
  void reportInput(diagnostic_updater::DiagnosticStatusWrapper& status);
  void reportQueues(diagnostic_updater::DiagnosticStatusWrapper& status);
  void reportTf(diagnostic_updater::DiagnosticStatusWrapper& status);

  FrontEndNodeOptions options_;
  int session_ = 0;  ///< earlier starts of this nodelet, see firstNumbers()
  SensorConfig sensor_;
  OdometryFrames frames_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::unique_ptr<tf2_ros::TransformBroadcaster> tf_broadcaster_;
  std::unique_ptr<CalibrationSource> calibration_;
  std::unique_ptr<TfRivals> rivals_;

  /// imu_monitor_: of topics.inertial(); accel_monitor_: of an accelerometer beside a gyroscope of its own.
  std::unique_ptr<StreamMonitor> color_monitor_, depth_monitor_, imu_monitor_, accel_monitor_;

  // Owned by the thread.
  std::unique_ptr<FrontEnd> front_end_;
  std::unique_ptr<DepthAlignment> alignment_;
  std::unique_ptr<ImagePairer> pairer_;
  ConstantFocus focus_;
  std::deque<std::function<void()>> early_;  ///< IMU samples received before the calibration is complete
  std::unique_ptr<StreamTime> time_;
  bool told_of_spikes_ = false;
  double posed_imu_t_ = -1e300;               ///< of the newest image with a pose
  double predicted_imu_t_ = -1e300;           ///< of the newest prediction between images
  Matrix15d covariance_ = Matrix15d::Zero();  ///< of the newest image; predictions between images carry it
  double last_feature_image_ = -1e300;

  // Passed from the owner thread to the diagnostics.
  struct Shown {
    TrackingStatus status;
    FrontEndCounters counters;
    CalibrationEstimate calibration;                   ///< renewed about once a second
    std::vector<std::string> calibration_differences;  ///< against the configuration
    PairerCounters pairs;
    std::size_t features = 0;
    double latency = 0;         ///< stamp to publishing, seconds (by ROS time)
    double processing = 0;      ///< last image, ms
    std::deque<double> recent;  ///< processing of the last images (a minute of them at 20 Hz), ms
    std::size_t time_jumps = 0, clock_steps = 0;
    std::size_t ahead = 0, stray = 0;  ///< messages left out, see StreamTime
    std::string start_problem;         ///< why the front end cannot start with the given sensor configuration
    std::string extrinsics;            ///< source of the extrinsics
    std::string size_problem;          ///< depth that does not fit the colour image, in words
  };
  DropWatch drops_;       ///< used by diagnostics only
  int ticks_ = 0;         ///< likewise
  double last_tick_ = 0;  ///< time of the last tick, s; likewise
  mutable std::mutex shown_mutex_;
  Shown shown_;
  std::deque<PairerCounters> lately_paired_;  ///< counters of the last reports; used by diagnostics only

  std::atomic<int> empty_depth_{0};  ///< depth images in a row that hold nothing within the sensor's range
  std::atomic<bool> paused_{false};
  std::atomic<bool> publish_tf_{true}, imu_rate_odometry_{false};
  std::atomic<double> feature_image_rate_{15.0};

  OwnerThread::Lane imu_lane_ = 0, info_lane_ = 0, image_lane_ = 0, depth_lane_ = 0, control_lane_ = 0;
  ros::Publisher odometry_pub_, imu_rate_pub_, frame_pub_, keyframe_pub_, status_pub_, calibration_pub_;
  image_transport::Publisher feature_image_pub_;
  ImageSource color_source_, depth_source_;
  GrayDecoder gray_;
  std::unique_ptr<ImageSubscriber> color_images_, depth_images_;
  std::vector<ros::Subscriber> subscribers_;
  std::unique_ptr<diagnostic_updater::Updater> diagnostics_;
  std::unique_ptr<OutputMonitor> odometry_monitor_;
  std::unique_ptr<dynamic_reconfigure::Server<vip_slam_frontend::FrontEndConfig>> reconfigure_;
  ros::WallTimer timer_;
  std::unique_ptr<OwnerThread> owner_;  ///< last member: stops before anything it uses is destroyed
};

}  // namespace vip_slam
