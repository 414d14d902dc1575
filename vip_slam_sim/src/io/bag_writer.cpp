// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include <cv_bridge/cv_bridge.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include "vip_slam_sim/io/sequence_writer.h"

namespace vip_slam {
namespace {

constexpr const char* kColorFrame = "camera_color_optical_frame";
constexpr const char* kDepthFrame = "camera_depth_optical_frame";
constexpr const char* kImuFrame = "camera_imu_optical_frame";

ros::Time stampOf(std::int64_t ns) {
  ros::Time t;
  t.fromNSec(static_cast<std::uint64_t>(ns));
  return t;
}

sensor_msgs::CameraInfo infoOf(const CameraIntrinsics& c, const std::string& frame) {
  sensor_msgs::CameraInfo info;
  info.header.frame_id = frame;
  info.width = c.width;
  info.height = c.height;
  info.distortion_model = c.model == DistortionModel::kEquidistant ? "equidistant" : "plumb_bob";
  info.D = c.distortion;
  if (c.model != DistortionModel::kEquidistant) info.D.resize(5, 0.0);
  info.K = {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0};
  return info;
}

geometry_msgs::TransformStamped transformOf(const SE3& T, const std::string& parent, const std::string& child,
                                            const ros::Time& stamp) {
  geometry_msgs::TransformStamped out;
  out.header.stamp = stamp;
  out.header.frame_id = parent;
  out.child_frame_id = child;
  out.transform.translation.x = T.t().x();
  out.transform.translation.y = T.t().y();
  out.transform.translation.z = T.t().z();
  out.transform.rotation.x = T.rotation().x();
  out.transform.rotation.y = T.rotation().y();
  out.transform.rotation.z = T.rotation().z();
  out.transform.rotation.w = T.rotation().w();
  return out;
}

template <class Vector>
void assign(Vector* out, const Eigen::Vector3d& in) {
  out->x = in.x();
  out->y = in.y();
  out->z = in.z();
}

class BagWriter : public SequenceWriter {
 public:
  BagWriter(const std::string& path, const SensorConfig& sensor, std::int64_t start_ns)
      : path_(path), part_(path + "." + std::to_string(getpid()) + ".part"), sensor_(sensor) {
    try {
      bag_->open(part_, rosbag::bagmode::Write);
    } catch (const rosbag::BagException& e) {
      throw std::runtime_error(path + ": cannot be written: " + e.what());
    }
    bag_->setCompression(rosbag::compression::LZ4);
    bag_->setChunkThreshold(4 << 20);
    color_info_ = infoOf(sensor.camera, kColorFrame);
    depth_frame_ = sensor.depth_registered ? kColorFrame : kDepthFrame;
    depth_info_ = infoOf(sensor.depth_registered ? sensor.camera : sensor.depth_camera, depth_frame_);
    tf2_msgs::TFMessage tf;
    const ros::Time start = stampOf(start_ns);
    if (sensor.topics.hasInertial()) {
      tf.transforms.push_back(transformOf(sensor.T_base_imu, "base_link", kImuFrame, start));
      tf.transforms.push_back(transformOf(sensor.T_imu_cam, kImuFrame, kColorFrame, start));
    } else {
      tf.transforms.push_back(transformOf(sensor.T_base_imu * sensor.T_imu_cam, "base_link", kColorFrame, start));
    }
    if (!sensor.depth_registered)
      tf.transforms.push_back(transformOf(sensor.T_color_depth, kColorFrame, kDepthFrame, start));
    auto latched = boost::make_shared<ros::M_string>();
    (*latched)["latching"] = "1";
    (*latched)["callerid"] = "/vip_slam_sim";
    (*latched)["topic"] = "/tf_static";
    (*latched)["type"] = ros::message_traits::DataType<tf2_msgs::TFMessage>::value();
    (*latched)["md5sum"] = ros::message_traits::MD5Sum<tf2_msgs::TFMessage>::value();
    (*latched)["message_definition"] = ros::message_traits::Definition<tf2_msgs::TFMessage>::value();
    bag_->write("/tf_static", start, tf, latched);
  }

  ~BagWriter() override {
    if (committed_) return;
    try {
      bag_->close();
    } catch (const std::exception&) {
      // The file is deleted below anyway. Leak the bag: its destructor would close it again and, on a full disk, throw
      // and so terminate the program.
      static_cast<void>(bag_.release());
    }
    std::error_code ignored;
    std::filesystem::remove(part_, ignored);
  }

  void imu(std::int64_t ns, const ImuSample& s, const NavState& x, const Eigen::Vector3d& omega_I) override {
    const ros::Time stamp = stampOf(ns);
    const bool inertial = sensor_.topics.hasInertial();
    sensor_msgs::Imu m;
    m.header.seq = imu_seq_;
    m.header.stamp = stamp;
    m.header.frame_id = kImuFrame;
    m.orientation_covariance[0] = -1;  // no orientation
    assign(&m.angular_velocity, s.gyro);
    assign(&m.linear_acceleration, s.accel);
    if (inertial) put(sensor_.topics.imu, stamp, m);

    nav_msgs::Odometry o;
    o.header.seq = imu_seq_++;
    o.header.stamp = stamp;
    o.header.frame_id = "world";
    o.child_frame_id = inertial ? kImuFrame : kColorFrame;
    assign(&o.pose.pose.position, x.T_W_I.t());
    const Eigen::Quaterniond& q = x.T_W_I.rotation();
    o.pose.pose.orientation.x = q.x();
    o.pose.pose.orientation.y = q.y();
    o.pose.pose.orientation.z = q.z();
    o.pose.pose.orientation.w = q.w();
    assign(&o.twist.twist.linear, x.T_W_I.rotation().conjugate() * x.v_W);
    assign(&o.twist.twist.angular, omega_I);
    put("/ground_truth/odometry", stamp, o);
  }

  void frame(const SimFrame& f) override {
    const ros::Time stamp = stampOf(f.stamp_ns);
    const auto seq = static_cast<std::uint32_t>(f.index);
    write(sensor_.topics.color, f.rgb, "rgb8", kColorFrame, stamp, seq);
    const ros::Time depth_stamp = stampOf(f.depth_stamp_ns);
    write(sensor_.topics.depth, f.depth, "16UC1", depth_frame_, depth_stamp, seq);
    color_info_.header.stamp = stamp;
    depth_info_.header.stamp = depth_stamp;
    color_info_.header.seq = depth_info_.header.seq = seq;
    put(sensor_.topics.color_info, stamp, color_info_);
    put(sensor_.topics.depth_info, depth_stamp, depth_info_);
  }

  void commit() override {
    try {
      bag_->close();
      std::filesystem::rename(part_, path_);
    } catch (const std::exception& e) {
      throw std::runtime_error(path_ + ": cannot be written: " + e.what());
    }
    committed_ = true;
  }

 private:
  template <class Message>
  void put(const std::string& topic, const ros::Time& stamp, const Message& message) {
    try {
      bag_->write(topic, stamp, message);
    } catch (const rosbag::BagException& e) {
      throw std::runtime_error(path_ + ": cannot be written: " + e.what());
    }
  }

  void write(const std::string& topic, const cv::Mat& image, const std::string& encoding, const std::string& frame,
             const ros::Time& stamp, std::uint32_t seq) {
    std_msgs::Header header;
    header.seq = seq;
    header.stamp = stamp;
    header.frame_id = frame;
    put(topic, stamp, *cv_bridge::CvImage(header, encoding, image).toImageMsg());
  }

  std::string path_, part_;
  SensorConfig sensor_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  sensor_msgs::CameraInfo color_info_, depth_info_;
  std::string depth_frame_;
  std::uint32_t imu_seq_ = 0;
  bool committed_ = false;
};

}  // namespace

std::unique_ptr<SequenceWriter> makeBagWriter(const std::string& path, const SensorConfig& sensor,
                                              std::int64_t start_ns) {
  return std::make_unique<BagWriter>(path, sensor, start_ns);
}

}  // namespace vip_slam
