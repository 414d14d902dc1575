// SPDX-License-Identifier: BSD-3-Clause
#include "driver_bag.h"

#include <cmath>

#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam::test_support {
namespace {

constexpr double kStart = 1700000000.0;

/// Pose of the IMU: at rest, then sines that start smoothly.
struct Motion {
  double still;
  SE3 T_imu_cam;

  SE3 cameraAt(double t) const {
    const double s = std::max(0.0, t - still);
    const double w = s * s * s / (s * s * s + 0.02);  // twice differentiable at the start
    const Eigen::Vector3d p(w * 0.15 * std::sin(1.9 * s), w * 0.2 * std::sin(1.3 * s),
                            1.4 + w * 0.1 * std::sin(2.3 * s));
    const double yaw = w * 0.35 * std::sin(1.7 * s), pitch = w * 0.22 * std::sin(2.3 * s),
                 roll = w * 0.2 * std::sin(2.9 * s);
    Eigen::Matrix3d R_level_cam;  // looking along +x: optical z = x, x = -y, y = -z
    R_level_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
            .toRotationMatrix() *
        R_level_cam;
    return SE3(R, p);
  }
  SE3 imuAt(double t) const { return cameraAt(t) * T_imu_cam.inverse(); }
  ImuSample sampleAt(double t, bool gravity) const {
    const double h = 1e-4;
    const SE3 before = imuAt(t - h), now = imuAt(t), after = imuAt(t + h);
    ImuSample s;
    s.t = t;
    s.gyro = logSO3(Eigen::Matrix3d(before.R().transpose() * after.R())) / (2 * h);
    const Eigen::Vector3d a = (after.t() - 2 * now.t() + before.t()) / (h * h);
    s.accel = now.R().transpose() * (a + (gravity ? gravityVector(9.81) : Eigen::Vector3d::Zero()));
    return s;
  }
};

/// Inside of a box of 5 x 4 x 2.8 m, every wall with its own random cells of 8 cm.
class Room {
 public:
  Room() : noise_(256, 256, CV_8UC1) {
    cv::RNG rng(11);
    rng.fill(noise_, cv::RNG::UNIFORM, 30, 225);
  }
  /// Grey value and depth z of a pixel's ray.
  void look(const SE3& T_W_C, const Eigen::Vector3d& ray_C, std::uint8_t* grey, float* z) const {
    const Eigen::Vector3d o = T_W_C.t(), d = T_W_C.R() * ray_C;
    double best = 1e9;
    int wall = 0;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(d[k]) < 1e-9) continue;
      const double s = ((d[k] > 0 ? high_[k] : low_[k]) - o[k]) / d[k];
      if (s > 0 && s < best) {
        best = s;
        wall = 2 * k + (d[k] > 0 ? 1 : 0);
      }
    }
    const Eigen::Vector3d p = o + best * d;
    const int k = wall / 2;
    const double u = (p[(k + 1) % 3] + 8.0 + 3 * wall) / 0.08, v = (p[(k + 2) % 3] + 8.0) / 0.08;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const double a = u - i, b = v - j;
    const auto at = [&](int c, int r) { return double(noise_.at<std::uint8_t>(r & 255, c & 255)); };
    *grey = static_cast<std::uint8_t>((1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) +
                                      b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1)));
    *z = static_cast<float>(best);  // ray_C has z = 1
  }

 private:
  Eigen::Vector3d low_{-2.5, -2.0, 0.0}, high_{2.5, 2.0, 2.8};
  cv::Mat noise_;
};

/// Directions (x, y, 1) of all pixels.
std::vector<Eigen::Vector3d> raysOf(const CameraIntrinsics& intrinsics) {
  const auto camera = makeCamera(intrinsics);
  std::vector<Eigen::Vector3d> rays;
  for (int v = 0; v < intrinsics.height; ++v)
    for (int u = 0; u < intrinsics.width; ++u) {
      Eigen::Vector2d xy;
      camera->undistort(Eigen::Vector2d(u, v), &xy);
      rays.emplace_back(xy.x(), xy.y(), 1);
    }
  return rays;
}

void render(const Room& room, const SE3& T_W_C, const std::vector<Eigen::Vector3d>& rays, cv::Mat* grey,
            cv::Mat* depth) {
  for (std::size_t i = 0; i < rays.size(); ++i)
    room.look(T_W_C, rays[i], grey->ptr<std::uint8_t>() + i, depth->ptr<float>() + i);
}

class Writer {
 public:
  Writer(const std::string& path, const DriverBagOptions& options)
      : options_(options), bag_(path, rosbag::bagmode::Write) {}

  template <class Message>
  void write(const std::string& topic, double t, const Message& message) {
    const auto other = options_.renamed.find(topic);
    const std::string name = other == options_.renamed.end() ? topic : other->second;
    if (!name.empty()) bag_.write(name, ros::Time(kStart + t), message);
  }
  std_msgs::Header header(double t, const std::string& frame) const {
    std_msgs::Header h;
    h.stamp = ros::Time(kStart + t + (t > 0.5 * (options_.still + options_.moving) ? options_.late_jump : 0.0));
    h.frame_id = frame;
    return h;
  }

 private:
  const DriverBagOptions& options_;
  rosbag::Bag bag_;
};

void writeColor(Writer* out, const DriverBagOptions& o, double t, const cv::Mat& grey) {
  const std::string encoding = o.other_encoding.empty() ? o.sensor.color_encoding : o.other_encoding;
  const auto header = out->header(t, o.frames.color);
  cv::Mat bgr, image = grey;
  cv::cvtColor(grey, bgr, cv::COLOR_GRAY2BGR);
  if (encoding == "compressed") {
    sensor_msgs::CompressedImage message;
    message.header = header;
    message.format = "bgr8; jpeg compressed bgr8";
    cv::imencode(".jpg", bgr, message.data, {cv::IMWRITE_JPEG_QUALITY, 92});
    out->write(o.sensor.topics.color, t, message);
    return;
  }
  if (encoding == "rgb8") cv::cvtColor(bgr, image, cv::COLOR_BGR2RGB);
  if (encoding == "bgr8") image = bgr;
  if (encoding == "bgra8") cv::cvtColor(bgr, image, cv::COLOR_BGR2BGRA);
  if (encoding == "rgba8") cv::cvtColor(bgr, image, cv::COLOR_BGR2RGBA);
  out->write(o.sensor.topics.color, t, imageMessage(image, encoding, header));
}

void writeDepth(Writer* out, const DriverBagOptions& o, double t, const cv::Mat& metres) {
  const double stamp = t + o.depth_skew;
  const auto header = out->header(stamp, o.frames.depth);
  cv::Mat depth = o.depth_unit_factor * metres, small;
  if (o.depth_divisor > 1) {
    cv::resize(depth, small, depth.size() / o.depth_divisor, 0, 0, cv::INTER_NEAREST);
    depth = small;
  }
  cv::Mat units;
  depth.convertTo(units, CV_16UC1, 1.0 / o.sensor.depth_scale);
  if (o.sensor.depth_encoding == "compressed") {
    sensor_msgs::CompressedImage message;
    message.header = header;
    message.format = "16UC1; png compressed ";
    cv::imencode(".png", units, message.data, {cv::IMWRITE_PNG_COMPRESSION, 1});
    out->write(o.sensor.topics.depth, stamp, message);
  } else if (o.sensor.depth_encoding == "32FC1") {
    out->write(o.sensor.topics.depth, stamp, imageMessage(depth, "32FC1", header));
  } else {
    out->write(o.sensor.topics.depth, stamp, imageMessage(units, "16UC1", header));
  }
}

void writeImu(Writer* out, const DriverBagOptions& o, const Motion& motion, double end) {
  const auto message = [&](double t, const std::string& frame, bool gyro, bool accel) {
    const ImuSample s = motion.sampleAt(t, o.gravity);
    sensor_msgs::Imu m;
    m.header = out->header(t, frame);
    m.orientation_covariance[0] = -1;
    if (gyro) {
      m.angular_velocity.x = o.gyro_factor * s.gyro.x();
      m.angular_velocity.y = o.gyro_factor * s.gyro.y();
      m.angular_velocity.z = o.gyro_factor * s.gyro.z();
    }
    if (accel) {
      m.linear_acceleration.x = o.accel_factor * s.accel.x();
      m.linear_acceleration.y = o.accel_factor * s.accel.y();
      m.linear_acceleration.z = o.accel_factor * s.accel.z();
    }
    return m;
  };
  const auto stream = [&](const std::string& topic, double rate, double phase, const std::string& frame, bool gyro,
                          bool accel) {
    if (topic.empty()) return;
    for (int k = 0; k < end * rate; ++k) {
      const double t = phase + k / rate;
      if (o.imu_hole_at >= 0 && t > o.imu_hole_at && t < o.imu_hole_at + o.imu_hole) continue;
      out->write(topic, t, message(t, frame, gyro, accel));
    }
  };
  stream(o.sensor.topics.imu, o.sensor.imu_rate, 0, o.frames.imu, true, true);
  stream(o.sensor.topics.gyro, o.sensor.imu_rate, 0, o.frames.gyro, true, false);
  stream(o.sensor.topics.accel, o.accel_rate, 0.0013, o.frames.accel, false, true);
}

void writeTf(Writer* out, const DriverBagOptions& o) {
  tf2_msgs::TFMessage message;
  const auto edge = [&](const std::string& parent, const std::string& child, const SE3& T) {
    geometry_msgs::TransformStamped t;
    t.header = out->header(0, parent);
    t.child_frame_id = child;
    t.transform.translation.x = T.t().x();
    t.transform.translation.y = T.t().y();
    t.transform.translation.z = T.t().z();
    t.transform.rotation.w = T.rotation().w();
    t.transform.rotation.x = T.rotation().x();
    t.transform.rotation.y = T.rotation().y();
    t.transform.rotation.z = T.rotation().z();
    message.transforms.push_back(t);
  };
  for (const TfEdge& e : o.edges) edge(e.parent, e.child, e.T_parent_child);
  if (o.edges.empty()) {
    edge("base_link", "camera_link", SE3());
    edge("camera_link", o.frames.color, SE3());
    for (const std::string& imu : {o.frames.imu, o.frames.gyro}) edge("camera_link", imu, o.sensor.T_imu_cam.inverse());
  }
  out->write("/tf_static", 0, message);
}

}  // namespace

Trajectory writeDriverBag(const std::string& path, const DriverBagOptions& o) {
  CameraIntrinsics camera = o.sensor.camera;
  if (o.width > 0) camera = camera.scaled(o.width, o.height);
  const Motion motion{o.still, o.sensor.T_imu_cam};
  const Room room;
  const double end = o.still + o.moving;
  Writer out(path, o);
  if (o.tf) writeTf(&out, o);
  writeImu(&out, o, motion, end + 0.1);
  // Rendered at half size when large: the drivers' sizes matter here, not their sharpness.
  const bool half = camera.width > 800;
  const CameraIntrinsics rendered = half ? camera.scaled(camera.width / 2, camera.height / 2) : camera;
  Trajectory truth;
  const double rate = o.sensor.color_rate * o.image_rate_factor;
  const bool own_depth = o.sensor.depth_undistorted;
  const std::vector<Eigen::Vector3d> rays = raysOf(rendered),
                                     depth_rays = own_depth ? raysOf(pinholeOf(rendered)) : rays;
  DriverBagOptions other = o;
  for (std::string* frame : {&other.frames.color, &other.frames.depth}) *frame = "back_" + *frame;
  cv::Mat grey, depth;
  for (int k = 0; k < end * rate; ++k) {
    const double t = 0.02 + k / rate, t_imu = t + o.sensor.time_offset;
    if (t > end) break;
    const bool again = o.repeat_every > 0 && k % o.repeat_every == o.repeat_every - 1;
    if (!again) {
      grey.create(rendered.height, rendered.width, CV_8UC1);
      depth.create(rendered.height, rendered.width, CV_32FC1);
      render(room, motion.cameraAt(t_imu), rays, &grey, &depth);
      cv::Mat unused(grey.size(), CV_8UC1);
      if (own_depth) render(room, motion.cameraAt(t_imu), depth_rays, &unused, &depth);
    }
    if (half && !again) {
      cv::resize(grey, grey, {camera.width, camera.height}, 0, 0, cv::INTER_LINEAR);
      cv::resize(depth, depth, {camera.width, camera.height}, 0, 0, cv::INTER_LINEAR);
    }
    writeColor(&out, o, t, grey);
    writeDepth(&out, o, t, depth);
    if (o.second_camera && t > 0.3) {
      cv::Mat other_grey, other_depth = 0.5 * depth;
      cv::flip(grey, other_grey, 1);
      writeColor(&out, other, t + 0.012, other_grey);
      writeDepth(&out, other, t + 0.012, other_depth);
    }
    const auto writeInfo = [&](const std::string& topic, const CameraIntrinsics& of, double stamp,
                               const std::string& frame) {
      sensor_msgs::CameraInfo info = cameraInfo(of, out.header(stamp, frame));
      if (!o.calibrated) info.K.fill(0.0), info.P.fill(0.0);
      if (k < o.empty_infos) {
        info.K.fill(0.0);
        info.P.fill(0.0);
        info.width = info.height = 0;
      }
      out.write(topic, stamp, info);
    };
    const SensorTopics& topics = o.sensor.topics;
    writeInfo(topics.color_info, camera, t, o.frames.color);
    if (topics.depth_info != topics.color_info)
      writeInfo(topics.depth_info, own_depth ? pinholeOf(camera) : camera, t + o.depth_skew, o.frames.depth);
    truth.push_back({kStart + t, motion.imuAt(t_imu)});
  }
  return truth;
}

}  // namespace vip_slam::test_support
