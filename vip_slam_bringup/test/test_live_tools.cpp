// SPDX-License-Identifier: BSD-3-Clause
// With a ROS master: check_bag's listening to live topics, and the stereo nodelet from messages to messages.
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <ros/topic.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <topic_tools/shape_shifter.h>
#include <opencv2/imgproc.hpp>

#include "driver_bag.h"
#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_ros/camera_info.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

/// Plays a bag's sensor messages in real time, stamped now.
class Player {
 public:
  explicit Player(const std::string& path) : bag_(path), thread_([this] { play(); }) {}
  ~Player() {
    stop_ = true;
    thread_.join();
  }

 private:
  template <class Message>
  bool send(const rosbag::MessageInstance& instance, const ros::Duration& shift) {
    const auto message = instance.instantiate<Message>();
    if (!message) return false;
    message->header.stamp += shift;
    auto& publisher = publishers_[instance.getTopic()];
    if (!publisher) publisher = nh_.advertise<Message>(instance.getTopic(), 200);
    publisher.publish(message);
    return true;
  }
  void play() {
    rosbag::View view(bag_);
    const ros::Duration shift = ros::Time::now() + ros::Duration(0.5) - view.getBeginTime();
    for (const auto& m : view) {
      if (stop_) return;
      const ros::Duration wait = m.getTime() + shift - ros::Time::now();
      if (wait > ros::Duration(0)) wait.sleep();
      send<sensor_msgs::Image>(m, shift) || send<sensor_msgs::CameraInfo>(m, shift) || send<sensor_msgs::Imu>(m, shift);
    }
  }

  ros::NodeHandle nh_;
  rosbag::Bag bag_;
  std::map<std::string, ros::Publisher> publishers_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(LiveTools, CheckListensToTopics) {
  test_support::DriverBagOptions options;
  options.sensor = loadSensorConfig(CONFIG_DIR "/sensors/d435i.yaml");
  options.width = 320;
  options.height = 240;
  options.moving = 9;
  const std::string path =
      (fs::temp_directory_path() / ("vip_slam_live_" + std::to_string(::getpid()) + ".bag")).string();
  test_support::writeDriverBag(path, options);
  {
    Player player(path);
    ros::Duration(1.5).sleep();
    const Findings findings = checkAll(recordLive(options.sensor, 6.0));
    for (const Finding& f : findings) EXPECT_NE(f.severity, Severity::kError) << f.about << ": " << f.text;
    bool imu = false;
    for (const Finding& f : findings) imu |= f.about == "IMU" && f.severity == Severity::kGood;
    EXPECT_TRUE(imu) << toText(findings, false);
  }
  fs::remove(path);
  // Nothing is published any more: the check reports that instead of waiting.
  const Findings silent = checkAll(recordLive(options.sensor, 1.0));
  EXPECT_EQ(worst(silent), Severity::kError);
}

TEST(LiveTools, StereoNodeletMakesDepth) {
  const StereoCalibration calibration = loadStereoCalibration(CONFIG_DIR "/stereo/euroc.yaml");
  ros::NodeHandle nh;
  ros::Publisher left = nh.advertise<sensor_msgs::Image>("/cam0/image_raw", 5),
                 right = nh.advertise<sensor_msgs::Image>("/cam1/image_raw", 5);
  cv::Mat noise(calibration.left.height, calibration.left.width, CV_8UC1);
  cv::RNG rng(5);
  rng.fill(noise, cv::RNG::UNIFORM, 20, 235);
  cv::GaussianBlur(noise, noise, {5, 5}, 1.2);
  sensor_msgs::Image::ConstPtr depth;
  sensor_msgs::CameraInfo::ConstPtr info;
  const ros::Subscriber d = nh.subscribe<sensor_msgs::Image>("/stereo/depth/image", 5,
                                                             [&](const sensor_msgs::Image::ConstPtr& m) { depth = m; });
  const ros::Subscriber i = nh.subscribe<sensor_msgs::CameraInfo>(
      "/stereo/depth/camera_info", 5, [&](const sensor_msgs::CameraInfo::ConstPtr& m) { info = m; });
  const ros::WallTime give_up = ros::WallTime::now() + ros::WallDuration(20);
  while (ros::ok() && (!depth || !info) && ros::WallTime::now() < give_up) {
    std_msgs::Header header;
    header.stamp = ros::Time::now();
    header.frame_id = "cam0";
    left.publish(imageMessage(noise, "mono8", header));
    right.publish(imageMessage(noise, "mono8", header));
    ros::WallDuration(0.2).sleep();
    ros::spinOnce();
  }
  ASSERT_TRUE(depth && info);
  EXPECT_EQ(depth->encoding, "32FC1");
  EXPECT_EQ(depth->width, 752u);
  const StereoDepth stereo(calibration, StereoDepthOptions());
  EXPECT_NEAR(intrinsicsFromCameraInfo(*info).fx, stereo.rectified().fx, 1e-6);
  // The same picture in both cameras: the disparity is what rectification shifts, about the offset of the principal
  // points; the message must be what the class computes.
  const cv::Mat expected = stereo.compute(noise, noise).depth;
  const cv::Mat found(depth->height, depth->width, CV_32FC1, const_cast<std::uint8_t*>(depth->data.data()),
                      depth->step);
  EXPECT_EQ(cv::norm(found, expected, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace vip_slam

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_live_tools");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
