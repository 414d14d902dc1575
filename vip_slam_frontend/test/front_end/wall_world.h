// SPDX-License-Identifier: BSD-3-Clause
// A camera that sways in front of a textured wall, and its front end, for tests of the facade.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_frontend/front_end.h"

namespace vip_slam {

constexpr double kFocal = 200, kCx = 159.5, kCy = 119.5, kWall = 2.5, kRest = 1.2;

/// The body is at rest for a while, then sways in front of a wall at x = kWall without rotating.
struct World {
  cv::Mat texture;
  World() : texture(1200, 2000, CV_8U) {
    cv::RNG random(5);
    random.fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, cv::Size(), 4.0);
    cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  }
  static Eigen::Vector3d position(double t) {
    const double s = std::max(0.0, t - kRest), ramp = 1.0 - std::exp(-s * s);
    return ramp * Eigen::Vector3d(0.3 * std::sin(1.1 * s), 0.6 * std::sin(0.9 * s), 0.25 * std::sin(1.6 * s));
  }
  static ImuSample imu(double t) {
    const double h = 1e-3;
    ImuSample sample;
    sample.t = t;
    sample.gyro = Eigen::Vector3d(1e-3, -2e-3, 1e-3);
    sample.accel = (position(t - h) - 2 * position(t) + position(t + h)) / (h * h) + gravityVector();
    return sample;
  }
  cv::Mat image(double t) const {
    const Eigen::Vector3d p = position(t);
    const double z = kWall - p.x();
    cv::Mat_<float> mx(240, 320), my(240, 320);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const double y = p.y() - (u - kCx) / kFocal * z, up = p.z() - (v - kCy) / kFocal * z;
        mx(v, u) = static_cast<float>(1000 - 180 * y);
        my(v, u) = static_cast<float>(600 - 180 * up);
      }
    }
    cv::Mat result;
    cv::remap(texture, result, mx, my, cv::INTER_LINEAR, cv::BORDER_REFLECT);
    return result;
  }
  static cv::Mat depth(double t) { return cv::Mat(240, 320, CV_32FC1, cv::Scalar(kWall - position(t).x())); }
  /// The same wall with a floor 0.9 m below and another wall 1.1 m to the left: depth alone constrains all directions.
  static cv::Mat cornerDepth(double t) {
    const Eigen::Vector3d p = position(t);
    cv::Mat_<float> depth(240, 320);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const double left = -(u - kCx) / kFocal, down = (v - kCy) / kFocal;
        double z = kWall - p.x();
        if (left > 0) z = std::min(z, (1.1 - p.y()) / left);
        if (down > 0) z = std::min(z, (0.9 + p.z()) / down);
        depth(v, u) = static_cast<float>(z);
      }
    }
    return depth;
  }
};

inline SensorConfig sensor() {
  SensorConfig config;
  config.topics.imu = "/imu";
  config.camera.width = 320;
  config.camera.height = 240;
  config.camera.fx = config.camera.fy = kFocal;
  config.camera.cx = kCx;
  config.camera.cy = kCy;
  Eigen::Matrix3d R_I_C;
  R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  config.T_imu_cam = SE3(R_I_C, Eigen::Vector3d::Zero());
  config.imu_noise = {1e-3, 1e-5, 1e-2, 1e-4};
  return config;
}

inline FrontEndOptions options() {
  FrontEndOptions o;
  o.tracking.max_features = 120;
  o.tracking.min_distance = 10;
  o.tracking.keyframe_corners = 60;
  return o;
}

class FrontEndTest : public ::testing::Test {
 protected:
  FrontEndTest() : front_end_(options(), sensor()) {}

  void feedImu(double until) {
    for (; imu_t_ < until + 0.02; imu_t_ += 0.005) front_end_.addImu(World::imu(imu_t_));
  }
  FrameOutput step(double t, bool dark = false, bool with_depth = true) {
    feedImu(t);
    FrameInput input{t + shift_, dark ? cv::Mat(240, 320, CV_8U, cv::Scalar(3)) : world_.image(t),
                     with_depth ? World::depth(t) : cv::Mat()};
    return front_end_.process(input);
  }
  FrameOutput run(double from, double to, bool dark = false, bool with_depth = true) {
    FrameOutput last;
    for (int k = static_cast<int>(std::lround(from * 20)); k < std::lround(to * 20); ++k) {
      last = step(0.05 * k, dark, with_depth);
      if (last.keyframe) keyframes_.push_back(last.keyframe);
    }
    return last;
  }
  static double error(const FrameOutput& output) {
    return (output.frame->state.T_W_I.t() - World::position(output.frame->t)).norm();
  }

  World world_;
  FrontEnd front_end_;
  std::vector<KeyframePtr> keyframes_;
  double imu_t_ = 0, shift_ = 0;
};

}  // namespace vip_slam
