// SPDX-License-Identifier: BSD-3-Clause
// Stereo pair in, rectified left image and depth out, for sensors without a depth camera (EuRoC).
//   subscribes  left/image_raw, right/image_raw  (mono8 or colour)
//   publishes   rectified/image, depth/image (32FC1 metres), rectified/camera_info, depth/camera_info
//   tf          <frame of the left image> -> <...>_rectified, which the images are stamped with (static)
//   parameters  ~calibration (file, required), ~max_skew (s), ~image_transport, the fields of StereoDepthOptions
#include <geometry_msgs/TransformStamped.h>
#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <pluginlib/class_list_macros.hpp>

#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/image_decoding.h"
#include "vip_slam_ros/parameters.h"

namespace vip_slam {

class StereoDepthNodelet : public nodelet::Nodelet {
 public:
  void onInit() override {
    // One callback at a time, so that pairs are published in order. The matching itself is multi-threaded.
    ros::NodeHandle& nh = getNodeHandle();
    ros::NodeHandle& parameters = getPrivateNodeHandle();
    const std::string calibration = parameters.param<std::string>("calibration", "");
    try {
      if (calibration.empty()) throw std::runtime_error(parameters.resolveName("calibration") + ": not set");
      StereoDepthOptions options;
      loadOptionsFromParameters(options, parameters, {"calibration", "max_skew", "image_transport"});
      stereo_ = std::make_unique<StereoDepth>(loadStereoCalibration(calibration), options);
    } catch (const std::exception& e) {
      NODELET_FATAL("Stereo depth does not start: %s", e.what());
      throw;
    }
    image_transport::ImageTransport transport(nh);
    image_publisher_ = transport.advertiseCamera("rectified/image", 5);
    depth_publisher_ = transport.advertiseCamera("depth/image", 5);
    // Short queues: when matching is too slow for the rate, images are dropped instead of increasing the latency.
    const image_transport::TransportHints hints("raw", ros::TransportHints(), parameters);
    left_.subscribe(transport, "left/image_raw", 3, hints);
    right_.subscribe(transport, "right/image_raw", 3, hints);
    sync_ = std::make_unique<message_filters::Synchronizer<Policy>>(Policy(3), left_, right_);
    sync_->setMaxIntervalDuration(ros::Duration(parameters.param("max_skew", 0.005)));
    sync_->registerCallback(&StereoDepthNodelet::onPair, this);
    watchdog_ = nh.createTimer(ros::Duration(5.0), &StereoDepthNodelet::onWatch, this);
  }

 private:
  using Policy = message_filters::sync_policies::ApproximateTime<sensor_msgs::Image, sensor_msgs::Image>;

  void onPair(const sensor_msgs::ImageConstPtr& left, const sensor_msgs::ImageConstPtr& right) {
    ++pairs_;
    try {
      const ros::WallTime begin = ros::WallTime::now();
      const StereoDepthFrame frame = stereo_->compute(left_gray_(*left, left), right_gray_(*right, right));
      const double taken = (ros::WallTime::now() - begin).toSec(), gap = (left->header.stamp - last_).toSec();
      if (!last_.isZero() && gap > 0 && taken > gap)
        NODELET_WARN_THROTTLE(10.0, "Stereo depth takes %.0f ms, pairs come every %.0f ms: some are left out",
                              1e3 * taken, 1e3 * gap);
      last_ = left->header.stamp;
      const std_msgs::Header header = rectifiedHeader(left->header);
      const auto info = boost::make_shared<sensor_msgs::CameraInfo>(cameraInfo(stereo_->rectified(), header));
      image_publisher_.publish(boost::make_shared<sensor_msgs::Image>(imageMessage(frame.gray, "mono8", header)), info);
      depth_publisher_.publish(boost::make_shared<sensor_msgs::Image>(imageMessage(frame.depth, "32FC1", header)),
                               info);
    } catch (const std::exception& e) {
      NODELET_ERROR_THROTTLE(5.0, "Stereo depth of %s and %s at %.3f s: %s", left_.getTopic().c_str(),
                             right_.getTopic().c_str(), left->header.stamp.toSec(), e.what());
    }
  }

  // Rectification rotates the camera by up to a degree, so the rectified images need their own frame in tf.
  std_msgs::Header rectifiedHeader(std_msgs::Header header) {
    if (header.frame_id.empty()) return header;
    const std::string raw = header.frame_id;
    header.frame_id += "_rectified";
    if (raw == raw_frame_) return header;
    raw_frame_ = raw;
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = header.stamp;
    transform.header.frame_id = raw;
    transform.child_frame_id = header.frame_id;
    transform.transform = toTransformMsg(stereo_->T_left_rectified());
    tf_.sendTransform(transform);
    return header;
  }

  void onWatch(const ros::TimerEvent&) {
    if (pairs_ == pairs_seen_)
      NODELET_WARN("Stereo depth: no image pair on %s and %s in the last 5 s", left_.getTopic().c_str(),
                   right_.getTopic().c_str());
    pairs_seen_ = pairs_;
  }

  std::unique_ptr<StereoDepth> stereo_;
  GrayDecoder left_gray_, right_gray_;
  ros::Time last_;  ///< stamp of the last pair
  tf2_ros::StaticTransformBroadcaster tf_;
  std::string raw_frame_;                                               ///< frame whose rectified one was sent to tf
  image_transport::CameraPublisher image_publisher_, depth_publisher_;  ///< each with its camera_info
  image_transport::SubscriberFilter left_, right_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> sync_;
  ros::Timer watchdog_;
  std::size_t pairs_ = 0, pairs_seen_ = 0;
};

}  // namespace vip_slam

PLUGINLIB_EXPORT_CLASS(vip_slam::StereoDepthNodelet, nodelet::Nodelet)
