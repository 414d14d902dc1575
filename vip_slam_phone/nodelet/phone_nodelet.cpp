// SPDX-License-Identifier: BSD-3-Clause
// A phone's streams as topics.
//   publishes   color/image_raw (bgr8), depth/image_raw (16UC1 mm), each with /compressed beside it and camera_info;
//               imu; odometry (the phone's own pose, for comparison); /diagnostics
//   tf          <base_frame> -> phone_imu_frame -> phone_color_optical_frame (static)
//   parameters  ~host (address, or auto), ~rtsp_port, ~record_port, ~depth_port, ~user, ~password, ~width (pixels),
//               ~base_frame (empty: the robot tells where the phone is)
#include <diagnostic_updater/diagnostic_updater.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <opencv2/imgcodecs.hpp>
#include <pluginlib/class_list_macros.hpp>

#include "vip_slam_core/sensor/phone_geometry.h"
#include "vip_slam_phone/net/find_phone.h"
#include "vip_slam_phone/troubles.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam::phone {

class PhoneNodelet : public nodelet::Nodelet {
 public:
  void onInit() override {
    ros::NodeHandle& nh = getNodeHandle();
    const ros::NodeHandle& parameters = getPrivateNodeHandle();
    PhoneOptions options;
    options.host = parameters.param<std::string>("host", "");
    options.rtsp_port = parameters.param("rtsp_port", options.rtsp_port);
    options.record_port = parameters.param("record_port", options.record_port);
    options.depth_port = parameters.param("depth_port", options.depth_port);
    options.credentials.user = parameters.param<std::string>("user", "");
    options.credentials.password = parameters.param<std::string>("password", "");
    options.width = parameters.param("width", options.width);
    try {
      if (options.host.empty()) throw std::runtime_error(parameters.resolveName("host") + ": not set");
      if (options.width < 160 || options.width > 1920)
        throw std::runtime_error(parameters.resolveName("width") + ": " + std::to_string(options.width) +
                                 ", expected 160 to 1920 pixels");
      if (options.host == "auto") options.host = findPhone();
    } catch (const std::exception& e) {
      NODELET_FATAL("The phone does not start: %s", e.what());
      throw;
    }
    color_ = advertise(nh, "color");
    depth_ = advertise(nh, "depth");
    imu_ = nh.advertise<sensor_msgs::Imu>("imu", 200);
    odometry_ = nh.advertise<nav_msgs::Odometry>("odometry", 50);
    sendExtrinsics(parameters.param<std::string>("base_frame", "base_link"));
    updater_ = std::make_unique<diagnostic_updater::Updater>(nh, parameters);
    updater_->setHardwareID(options.host);
    updater_->add("phone", this, &PhoneNodelet::diagnose);
    last_look_ = ros::SteadyTime::now();
    client_ = std::make_unique<PhoneClient>(
        options, [] { return ros::Time::now().toSec(); }, [this](const Assembled& out) { publish(out); });
    timer_ = nh.createSteadyTimer(ros::WallDuration(2.0),
                                  [this](const ros::SteadyTimerEvent&) { updater_->force_update(); });
    NODELET_INFO("The phone at %s: video, IMU and depth on ports %d, %d, %d", options.host.c_str(), options.rtsp_port,
                 options.record_port, options.depth_port);
  }

  ~PhoneNodelet() override {
    timer_.stop();
    client_.reset();
  }

 private:
  struct ImageTopics {
    ros::Publisher raw, compressed, info;
  };

  static ImageTopics advertise(ros::NodeHandle& nh, const std::string& name) {
    return {nh.advertise<sensor_msgs::Image>(name + "/image_raw", 5),
            nh.advertise<sensor_msgs::CompressedImage>(name + "/image_raw/compressed", 5),
            nh.advertise<sensor_msgs::CameraInfo>(name + "/camera_info", 5)};
  }

  void sendExtrinsics(const std::string& base_frame) {
    std::vector<geometry_msgs::TransformStamped> transforms(1);
    transforms[0].header.frame_id = "phone_imu_frame";
    transforms[0].child_frame_id = "phone_color_optical_frame";
    transforms[0].transform = toTransformMsg(phoneCameraInImu());
    if (!base_frame.empty()) {
      transforms.emplace_back();
      transforms[1].header.frame_id = base_frame;
      transforms[1].child_frame_id = "phone_imu_frame";
      transforms[1].transform = toTransformMsg(SE3());
    }
    for (auto& transform : transforms) transform.header.stamp = ros::Time::now();
    tf_.sendTransform(transforms);
  }

  void publish(const Assembled& out) {
    for (const ImuSample& sample : out.imu) {
      sensor_msgs::Imu message;
      message.header.stamp = toStamp(sample.t);
      message.header.frame_id = "phone_imu_frame";
      message.orientation_covariance[0] = -1;
      message.angular_velocity = toVectorMsg(sample.gyro);
      message.linear_acceleration = toVectorMsg(sample.accel);
      imu_.publish(boost::make_shared<sensor_msgs::Imu>(message));
    }
    for (const ImageOut& image : out.color)
      publish(color_, image, image.image, "bgr8", ".jpg", "bgr8; jpeg compressed bgr8", {cv::IMWRITE_JPEG_QUALITY, 95});
    for (const ImageOut& image : out.depth) {
      cv::Mat millimetres;
      image.image.convertTo(millimetres, CV_16U, 1000);
      publish(depth_, image, millimetres, "16UC1", ".png", "16UC1; png compressed ", {cv::IMWRITE_PNG_COMPRESSION, 1});
    }
    for (const PoseOut& pose : out.pose) {
      if (pose.pose.tracking == 0) continue;
      nav_msgs::Odometry message;
      message.header.stamp = toStamp(pose.t);
      message.header.frame_id = "phone_world";
      message.child_frame_id = "phone_imu_frame";
      message.pose.pose = toPoseMsg(arkitWorldZUp() * pose.pose.T_world_cam * phoneCameraInImu().inverse());
      odometry_.publish(message);
    }
  }

  static void publish(const ImageTopics& topics, const ImageOut& out, const cv::Mat& image, const char* encoding,
                      const char* ending, const char* format, const std::vector<int>& parameters) {
    std_msgs::Header header;
    header.stamp = toStamp(out.t);
    header.frame_id = "phone_color_optical_frame";
    const auto info = boost::make_shared<sensor_msgs::CameraInfo>(toCameraInfo(out.camera));
    info->header = header;
    topics.info.publish(info);
    if (topics.raw.getNumSubscribers() > 0) {
      const auto message = boost::make_shared<sensor_msgs::Image>();
      message->header = header;
      message->encoding = encoding;
      message->width = static_cast<std::uint32_t>(image.cols);
      message->height = static_cast<std::uint32_t>(image.rows);
      message->step = static_cast<std::uint32_t>(image.cols * image.elemSize());
      message->data.assign(image.datastart, image.dataend);
      topics.raw.publish(message);
    }
    if (topics.compressed.getNumSubscribers() == 0) return;
    const auto message = boost::make_shared<sensor_msgs::CompressedImage>();
    message->header = header;
    message->format = format;
    cv::imencode(ending, image, message->data, parameters);
    topics.compressed.publish(message);
  }

  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
    const PhoneStatus now = client_->status();
    const ros::SteadyTime time = ros::SteadyTime::now();
    const double seconds = std::max(0.1, (time - last_look_).toSec());
    const std::vector<std::string> words = troubles(before_, now, seconds);
    status.summary(diagnostic_msgs::DiagnosticStatus::OK, "receiving");
    for (const std::string& word : words) {
      const bool first = status.level == diagnostic_msgs::DiagnosticStatus::OK;
      if (first)
        status.summary(diagnostic_msgs::DiagnosticStatus::WARN, word);
      else
        status.summary(diagnostic_msgs::DiagnosticStatus::WARN, status.message + "; " + word);
      NODELET_WARN_THROTTLE(10.0, "Phone: %s", word.c_str());
    }
    status.addf("images a second", "%.1f", (now.color - before_.color) / seconds);
    status.addf("depth images a second", "%.1f", (now.depth_images - before_.depth_images) / seconds);
    status.addf("IMU samples a second", "%.1f", (now.imu - before_.imu) / seconds);
    status.add("video packets lost", now.video.lost);
    status.add("depth images lost", now.depth.lost);
    status.add("records lost", now.assembly.imu_lost);
    status.add("images before the first sender report", now.untimed);
    status.add("images left out", now.assembly.dropped);
    status.add("images, samples not published in time",
               std::to_string(now.left_out.images) + ", " + std::to_string(now.left_out.samples));
    status.add("connections of video, records, depth", std::to_string(now.video.connections) + ", " +
                                                           std::to_string(now.records.connections) + ", " +
                                                           std::to_string(now.depth.connections));
    status.addf("clock offset, s", "%.4f", now.clock_offset);
    status.addf("clock slew, ppm", "%.1f", 1e6 * now.clock_slew);
    status.addf("focal length against the constant one", "%.4f", now.breathing);
    before_ = now;
    last_look_ = time;
  }

  ImageTopics color_, depth_;
  ros::Publisher imu_, odometry_;
  tf2_ros::StaticTransformBroadcaster tf_;
  std::unique_ptr<diagnostic_updater::Updater> updater_;
  ros::SteadyTimer timer_;
  ros::SteadyTime last_look_;
  PhoneStatus before_;
  std::unique_ptr<PhoneClient> client_;  ///< last: its threads publish
};

}  // namespace vip_slam::phone

PLUGINLIB_EXPORT_CLASS(vip_slam::phone::PhoneNodelet, nodelet::Nodelet)
