// SPDX-License-Identifier: BSD-3-Clause
// Stereo depth against rendered pairs whose depth is known.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_core/geometry/plane.h"

namespace vip_slam {
namespace {

/// A wall textured by random cells of `cell` metres, bilinearly blended: seeded, so every run sees the same wall.
class Wall {
 public:
  Wall(const Plane& plane_left, double cell) : plane_(plane_left), cell_(cell), noise_(512, 512, CV_8UC1) {
    cv::RNG rng(7);
    rng.fill(noise_, cv::RNG::UNIFORM, 20, 235);
  }

  /// Depth along the ray from `origin` (both in the left frame), negative when it misses.
  double hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, Eigen::Vector3d* point) const {
    const double s = -plane_.signedDistance(origin) / plane_.n.dot(ray);
    *point = origin + s * ray;
    return s;
  }

  double grey(const Eigen::Vector3d& p) const {
    const double x = p.x() / cell_ + 256, y = p.y() / cell_ + 256;
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const double a = x - i, b = y - j;
    const auto at = [&](int c, int r) { return double(noise_.at<std::uint8_t>(r & 511, c & 511)); };
    return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  }

  const Plane& plane() const { return plane_; }

 private:
  Plane plane_;
  double cell_;
  cv::Mat noise_;
};

/// The wall as the camera sees it, lens distortion included.
cv::Mat render(const Wall& wall, const CameraIntrinsics& intrinsics, const SE3& T_left_cam) {
  const auto camera = makeCamera(intrinsics);
  cv::Mat image(intrinsics.height, intrinsics.width, CV_8UC1, cv::Scalar(0));
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      Eigen::Vector2d xy;
      if (!camera->undistort(Eigen::Vector2d(u, v), &xy)) continue;
      Eigen::Vector3d p;
      if (wall.hit(T_left_cam.t(), T_left_cam.R() * Eigen::Vector3d(xy.x(), xy.y(), 1), &p) > 0)
        image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(wall.grey(p)));
    }
  return image;
}

struct DepthErrors {
  double coverage = 0, median = 0, p95 = 0;
};

/// Measured depth against the wall, seen from the rectified left camera; inner region, away from the matcher's blind
/// stripe on the left.
DepthErrors compare(const StereoDepth& stereo, const Wall& wall, const cv::Mat& depth) {
  const CameraIntrinsics& k = stereo.rectified();
  const SE3& T_left_rectified = stereo.T_left_rectified();
  std::vector<double> errors;
  std::size_t all = 0;
  for (int v = 30; v < depth.rows - 30; v += 3)
    for (int u = 130; u < depth.cols - 30; u += 3) {
      Eigen::Vector3d p;
      const Eigen::Vector3d ray = T_left_rectified.R() * Eigen::Vector3d((u - k.cx) / k.fx, (v - k.cy) / k.fy, 1);
      const double z = wall.hit(Eigen::Vector3d::Zero(), ray, &p);
      ++all;
      if (depth.at<float>(v, u) > 0) errors.push_back(std::abs(depth.at<float>(v, u) - z));
    }
  DepthErrors out;
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  out.coverage = double(errors.size()) / all;
  out.median = errors[errors.size() / 2];
  out.p95 = errors[errors.size() * 95 / 100];
  return out;
}

StereoCalibration idealPair(double baseline) {
  StereoCalibration c;
  c.left.width = 640;
  c.left.height = 480;
  c.left.fx = c.left.fy = 450;
  c.left.cx = 320;
  c.left.cy = 240;
  c.right = c.left;
  c.T_imu_right = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(baseline, 0, 0));
  return c;
}

TEST(StereoDepth, DisparityOfAFrontalWallIsItsDepth) {
  const StereoCalibration calibration = idealPair(0.1);
  // f B / z = 450 * 0.1 / 1.5 = 30 px exactly.
  const Wall wall(Plane::fromPointNormal({0, 0, 1.5}, {0, 0, -1}), 0.015);
  const StereoDepth stereo(calibration, StereoDepthOptions());
  EXPECT_NEAR(stereo.baseline(), 0.1, 1e-9);
  EXPECT_NEAR(stereo.rectified().fx, 450, 1e-3);
  const auto frame = stereo.compute(render(wall, calibration.left, SE3()),
                                    render(wall, calibration.right, calibration.T_left_right()));
  const DepthErrors e = compare(stereo, wall, frame.depth);
  EXPECT_GT(e.coverage, 0.97);
  EXPECT_LT(e.median, 0.002);
  EXPECT_LT(e.p95, 0.01);
}

TEST(StereoDepth, SlantedWallThroughTheDistortedEurocPair) {
  const StereoCalibration calibration = loadStereoCalibration(CONFIG_DIR "/stereo/euroc.yaml");
  const Wall wall(Plane::fromPointNormal({0, 0, 2.0}, {0.4, 0.2, -1.0}), 0.02);
  const StereoDepth stereo(calibration, StereoDepthOptions());
  EXPECT_NEAR(stereo.baseline(), 0.110, 0.001);
  const auto frame = stereo.compute(render(wall, calibration.left, SE3()),
                                    render(wall, calibration.right, calibration.T_left_right()));
  const DepthErrors e = compare(stereo, wall, frame.depth);
  EXPECT_GT(e.coverage, 0.95);
  // A tenth of a pixel of disparity at 2 m is 8 mm.
  EXPECT_LT(e.median, 0.006);
  EXPECT_LT(e.p95, 0.02);
}

TEST(StereoDepth, RectifiedFrameIsTheLeftOneTurned) {
  const StereoCalibration calibration = loadStereoCalibration(CONFIG_DIR "/stereo/euroc.yaml");
  const StereoDepth stereo(calibration, StereoDepthOptions());
  EXPECT_LT(stereo.T_left_rectified().t().norm(), 1e-12);
  EXPECT_LT((stereo.T_imu_rectified().t() - calibration.T_imu_left.t()).norm(), 1e-12);
  // The baseline is the x axis of the rectified frame.
  const Eigen::Vector3d b = stereo.T_left_rectified().R().transpose() * calibration.T_left_right().t();
  EXPECT_NEAR(b.x(), stereo.baseline(), 1e-6);
  EXPECT_NEAR(b.tail<2>().norm(), 0, 1e-6);
}

TEST(StereoDepth, RefusesWhatItCannotUse) {
  StereoCalibration swapped = idealPair(-0.1);
  EXPECT_THROW(StereoDepth(swapped, StereoDepthOptions()), std::invalid_argument);
  StereoCalibration unequal = idealPair(0.1);
  unequal.right.width = 320;
  EXPECT_THROW(StereoDepth(unequal, StereoDepthOptions()), std::invalid_argument);
  const StereoDepth stereo(idealPair(0.1), StereoDepthOptions());
  const cv::Mat good(480, 640, CV_8UC1, cv::Scalar(0)), small(240, 320, CV_8UC1, cv::Scalar(0));
  EXPECT_THROW(stereo.compute(good, small), std::invalid_argument);
  EXPECT_THROW(stereo.compute(cv::Mat(480, 640, CV_8UC3), good), std::invalid_argument);
  // A blank pair has no match and therefore no depth, not a wrong one.
  EXPECT_EQ(cv::countNonZero(stereo.compute(good, good).depth), 0);
  EXPECT_THROW(loadStereoCalibration("/nowhere/stereo.yaml"), std::runtime_error);
}

}  // namespace
}  // namespace vip_slam
