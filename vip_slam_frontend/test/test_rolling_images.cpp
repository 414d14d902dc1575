// Images and depth whose rows are read one after the other while the body turns and sways before a textured corner.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

constexpr double kReadout = 0.03, kStill = 1.2;

SensorConfig sensor(double colour_readout, double depth_readout) {
  SensorConfig config;
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

class World {
 public:
  World() : texture_(1024, 1024, CV_8U) {
    cv::RNG random(7);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, cv::Size(), 4.0);
    cv::normalize(texture_, texture_, 0, 255, cv::NORM_MINMAX);
  }

  /// Up to 1.3 rad/s and 6 rad/s^2, 0.6 m/s.
  static SE3 pose(double t) {
    const double s = std::max(0.0, t - kStill), ramp = 1.0 - std::exp(-s * s);
    const Eigen::Vector3d angles = ramp * Eigen::Vector3d(0.1 * std::sin(2.9 * s), 0.15 * std::sin(3.7 * s),
                                                          0.25 * std::sin(4.3 * s));
    const Eigen::Vector3d p = ramp * Eigen::Vector3d(0.2 * std::sin(1.1 * s), 0.4 * std::sin(1.3 * s),
                                                     0.2 * std::sin(1.6 * s));
    return SE3(Eigen::Matrix3d(expSO3(angles)), p);
  }
  static ImuSample imu(double t) {
    const double h = 1e-3;
    const SE3 before = pose(t - h), now = pose(t), after = pose(t + h);
    ImuSample sample;
    sample.t = t;
    sample.gyro = logSO3(Eigen::Quaterniond(Eigen::Matrix3d(before.R().transpose() * after.R()))) / (2 * h);
    sample.accel = now.R().transpose() * ((before.t() - 2 * now.t() + after.t()) / (h * h) + gravityVector());
    return sample;
  }
  /// Every row where the camera is when it is read.
  void look(double t, double readout, cv::Mat* image, cv::Mat* depth) const {
    const SensorConfig config = sensor(0, 0);
    *image = cv::Mat(240, 320, CV_8U);
    *depth = cv::Mat(240, 320, CV_32FC1);
    // Two walls that meet, and a floor: n.x = d, and the directions of the texture.
    struct Face {
      Eigen::Vector3d n, a, b;
      double d;
    };
    const double c = std::sqrt(0.5);
    const Face faces[] = {{{c, c, 0}, {c, -c, 0}, {0, 0, 1}, 1.9}, {{c, -c, 0}, {c, c, 0}, {0, 0, 1}, 1.9},
                          {{0, 0, -1}, {1, 0, 0}, {0, 1, 0}, 1.1}};
    for (int v = 0; v < 240; ++v) {
      const SE3 T_W_C = pose(t + readout * ((v + 0.5) / 240 - 0.5)) * config.T_imu_cam;
      for (int u = 0; u < 320; ++u) {
        const Eigen::Vector3d ray =
            T_W_C.R() * Eigen::Vector3d((u - config.camera.cx) / config.camera.fx,
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
        const int ix = static_cast<int>(x), iy = static_cast<int>(y);
        const double fx = x - ix, fy = y - iy;
        const auto texel = [&](int dx, int dy) { return double(texture_.at<std::uint8_t>((iy + dy) & 1023, (ix + dx) & 1023)); };
        image->at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(
            (1 - fy) * ((1 - fx) * texel(0, 0) + fx * texel(1, 0)) + fy * ((1 - fx) * texel(0, 1) + fx * texel(1, 1)));
        depth->at<float>(v, u) = static_cast<float>(nearest);
      }
    }
  }

 private:
  cv::Mat texture_;
};

/// Root mean square of the position's error over five seconds of motion, metres. `told`: the sensor's readouts.
double errorOf(double colour_told, double depth_told, bool depth_rolls) {
  const World world;
  FrontEndOptions options;
  options.tracking.max_features = 120;
  options.tracking.min_distance = 10;
  FrontEnd front_end(options, sensor(colour_told, depth_told));
  double imu_t = 0, square = 0;
  int n = 0;
  for (int k = 0; k < 125; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(World::imu(imu_t));
    FrameInput input;
    input.t = t;
    cv::Mat instant, not_used;
    world.look(t, kReadout, &input.gray, &input.depth);
    if (!depth_rolls) {
      world.look(t, 0, &not_used, &instant);
      input.depth = instant;
    }
    const FrameOutput output = front_end.process(input);
    if (t < kStill + 0.05) continue;
    square += (output.frame->state.T_W_I.t() - World::pose(t).t()).squaredNorm();
    ++n;
  }
  return std::sqrt(square / n);
}

TEST(RollingImages, RowsAreTakenForWhatTheyAre) {
  const double told = errorOf(kReadout, kReadout, true), not_told = errorOf(0, 0, true);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(not_told, 4 * told);
}

TEST(RollingImages, DepthOfOneInstantBelongsToTheStamp) {
  const double told = errorOf(kReadout, 0, false), taken_for_rolling = errorOf(kReadout, kReadout, false);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(taken_for_rolling, 2 * told);
}

}  // namespace
}  // namespace vip_slam
