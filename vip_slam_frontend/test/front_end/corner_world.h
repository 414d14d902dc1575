// SPDX-License-Identifier: BSD-3-Clause
// A textured corner of a room, seen by a camera with an IMU that turns and sways: images and depth for tests of the
// whole front end.
#pragma once

#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_frontend/front_end_options.h"

namespace vip_slam {

constexpr double kStill = 1.2;  // s at the start

/// Options for its small images.
inline FrontEndOptions cornerOptions() {
  FrontEndOptions options;
  options.tracking.max_features = 120;
  options.tracking.min_distance = 10;
  return options;
}

inline SensorConfig cornerSensor(double colour_readout, double depth_readout) {
  SensorConfig config;
  config.topics.imu = "/imu";
  config.camera.width = 320;
  config.camera.height = 240;
  config.camera.fx = config.camera.fy = 250;
  config.camera.cx = 159.5;
  config.camera.cy = 119.5;
  Eigen::Matrix3d R_I_C;
  R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  config.T_imu_cam = SE3(R_I_C, Eigen::Vector3d(0.03, 0.02, 0));
  config.imu_noise = {1e-3, 1e-5, 1e-2, 1e-4};
  config.rolling_shutter = colour_readout;
  config.depth_rolling_shutter = depth_readout;
  return config;
}

/// An upright screen with the same texture, across the view.
struct Screen {
  double x = 0.9;    ///< m in front of the camera's start
  double y = 0;      ///< its middle
  double width = 0;  ///< 0: not there
};

class CornerWorld {
 public:
  CornerWorld() : texture_(1024, 1024, CV_8U) {
    cv::RNG random(7);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, cv::Size(), 4.0);
    cv::normalize(texture_, texture_, 0, 255, cv::NORM_MINMAX);
  }

  /// True pose T_W_I at time t: up to 1.3 rad/s, 6 rad/s^2 and 0.6 m/s.
  static SE3 pose(double t) {
    const double s = std::max(0.0, t - kStill), ramp = 1.0 - std::exp(-s * s);
    const Eigen::Vector3d angles =
        ramp * Eigen::Vector3d(0.1 * std::sin(2.9 * s), 0.15 * std::sin(3.7 * s), 0.25 * std::sin(4.3 * s));
    const Eigen::Vector3d p =
        ramp * Eigen::Vector3d(0.2 * std::sin(1.1 * s), 0.4 * std::sin(1.3 * s), 0.2 * std::sin(1.6 * s));
    return SE3(Eigen::Matrix3d(expSO3(angles)), p);
  }
  /// Time at which the motion is where the motion at `speed` times its speed is at `t`.
  static double atSpeed(double speed, double t) { return kStill + speed * (t - kStill); }
  static ImuSample imu(double t, double speed = 1.0) {
    const double h = 1e-3;
    const SE3 before = pose(atSpeed(speed, t - h)), now = pose(atSpeed(speed, t)), after = pose(atSpeed(speed, t + h));
    ImuSample sample;
    sample.t = t;
    sample.gyro = logSO3(Eigen::Quaterniond(Eigen::Matrix3d(before.R().transpose() * after.R()))) / (2 * h);
    sample.accel = now.R().transpose() * ((before.t() - 2 * now.t() + after.t()) / (h * h) + gravityVector());
    return sample;
  }
  /// Renders each row from the camera's pose at its readout time.
  void look(double t, double readout, cv::Mat* image, cv::Mat* depth, const Screen& screen = {}) const {
    const SensorConfig config = cornerSensor(0, 0);
    *image = cv::Mat(240, 320, CV_8U);
    *depth = cv::Mat(240, 320, CV_32FC1);
    // Two walls that meet, and a floor: n.x = d, and the directions of the texture.
    struct Face {
      Eigen::Vector3d n, a, b;
      double d;
    };
    const double c = std::sqrt(0.5);
    const Face faces[] = {{{c, c, 0}, {c, -c, 0}, {0, 0, 1}, 1.9},
                          {{c, -c, 0}, {c, c, 0}, {0, 0, 1}, 1.9},
                          {{0, 0, -1}, {1, 0, 0}, {0, 1, 0}, 1.1}};
    for (int v = 0; v < 240; ++v) {
      const SE3 T_W_C = pose(t + readout * ((v + 0.5) / 240 - 0.5)) * config.T_imu_cam;
      for (int u = 0; u < 320; ++u) {
        const Eigen::Vector3d ray = T_W_C.R() * Eigen::Vector3d((u - config.camera.cx) / config.camera.fx,
                                                                (v - config.camera.cy) / config.camera.fy, 1.0);
        double nearest = 1e9, x = 0, y = 0;
        for (const Face& face : faces) {
          const double z = (face.d - face.n.dot(T_W_C.t())) / face.n.dot(ray);
          if (!(z > 0) || z >= nearest) continue;
          nearest = z;
          const Eigen::Vector3d p = T_W_C.t() + z * ray;
          x = 512 + 170 * p.dot(face.a) + 100 * face.n.y();
          y = 512 + 170 * p.dot(face.b);
        }
        const double z = (screen.x - T_W_C.t().x()) / ray.x();
        const double aside = T_W_C.t().y() + z * ray.y() - screen.y;
        if (z > 0 && z < nearest && std::abs(aside) < 0.5 * screen.width) {
          nearest = z;
          x = 512 + 170 * aside;
          y = 512 + 170 * (T_W_C.t().z() + z * ray.z());
        }
        const int ix = static_cast<int>(x), iy = static_cast<int>(y);
        const double fx = x - ix, fy = y - iy;
        const auto texel = [&](int dx, int dy) {
          return double(texture_.at<std::uint8_t>((iy + dy) & 1023, (ix + dx) & 1023));
        };
        image->at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(
            (1 - fy) * ((1 - fx) * texel(0, 0) + fx * texel(1, 0)) + fy * ((1 - fx) * texel(0, 1) + fx * texel(1, 1)));
        depth->at<float>(v, u) = static_cast<float>(nearest);
      }
    }
  }

 private:
  cv::Mat texture_;
};

}  // namespace vip_slam
