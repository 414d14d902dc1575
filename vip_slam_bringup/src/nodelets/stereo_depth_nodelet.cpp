// Stereo pair in, rectified left image and depth out, for sensors without a depth camera (EuRoC).
//   subscribes  left/image_raw, right/image_raw  (mono8 or colour)
//   publishes   rectified/image, depth/image (32FC1 metres), rectified/camera_info, depth/camera_info
//   tf          <frame of the left image> -> <...>_rectified, which the images are stamped with (static)
//   parameters  ~calibration (file, required), ~max_skew (s), the fields of StereoDepthOptions
#include <geometry_msgs/TransformStamped.h>
#include <message_filters/subscriber.h>
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
      loadOptionsFromParameters(options, parameters, {"calibration", "max_skew"});
      stereo_ = std::make_unique<StereoDepth>(loadStereoCalibration(calibration), options);
    } catch (const std::exception& e) {
      NODELET_FATAL("Stereo depth does not start: %s", e.what());
      throw;
    }
    image_publisher_ = nh.advertise<sensor_msgs::Image>("rectified/image", 5);
    image_info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("rectified/camera_info", 5);
    depth_publisher_ = nh.advertise<sensor_msgs::Image>("depth/image", 5);
    depth_info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("depth/camera_info", 5);
    // Short queues: when matching is too slow for the rate, images are dropped instead of increasing the latency.
    left_.subscribe(nh, "left/image_raw", 3);
    right_.subscribe(nh, "right/image_raw", 3);
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
      const StereoDepthFrame frame = stereo_->compute(decodeGray(*left), decodeGray(*right));
      const double taken = (ros::WallTime::now() - begin).toSec(), gap = (left->header.stamp - last_).toSec();
      if (!last_.isZero() && gap > 0 && taken > gap)
        NODELET_WARN_THROTTLE(10.0, "Stereo depth takes %.0f ms, pairs come every %.0f ms: some are left out",
                              1e3 * taken, 1e3 * gap);
      last_ = left->header.stamp;
      const std_msgs::Header header = rectifiedHeader(left->header);
      const sensor_msgs::CameraInfo info = cameraInfo(stereo_->rectified(), header);
      image_publisher_.publish(boost::make_shared<sensor_msgs::Image>(imageMessage(frame.gray, "mono8", header)));
      image_info_publisher_.publish(info);
      depth_publisher_.publish(boost::make_shared<sensor_msgs::Image>(imageMessage(frame.depth, "32FC1", header)));
      depth_info_publisher_.publish(info);
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
    const Eigen::Quaterniond q = stereo_->T_left_rectified().rotation();
    transform.transform.rotation.x = q.x();
    transform.transform.rotation.y = q.y();
    transform.transform.rotation.z = q.z();
    transform.transform.rotation.w = q.w();
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
  ros::Time last_;  ///< stamp of the last pair
  tf2_ros::StaticTransformBroadcaster tf_;
  std::string raw_frame_;  ///< frame whose rectified one was sent to tf
  ros::Publisher image_publisher_, image_info_publisher_, depth_publisher_, depth_info_publisher_;
  message_filters::Subscriber<sensor_msgs::Image> left_, right_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> sync_;
  ros::Timer watchdog_;
  std::size_t pairs_ = 0, pairs_seen_ = 0;
};

}  // namespace vip_slam

PLUGINLIB_EXPORT_CLASS(vip_slam::StereoDepthNodelet, nodelet::Nodelet)
