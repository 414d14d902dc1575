// SPDX-License-Identifier: BSD-3-Clause
// A patch's surface from depth, and its warp into another view against the exact homography of the plane.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_camera.h"
#include "vip_slam_frontend/tracking/patch_alignment.h"
#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {
namespace {

const Eigen::Vector2d kPixel(420, 200);

/// A wall on the right, along which the camera looks: seen at about 15 degrees in kPixel.
const Eigen::Vector3d kNormal = Eigen::Vector3d(-1.0, 0.1, 0.02).normalized();
constexpr double kDistance = 1.2;  ///< n . p + d = 0

Eigen::Vector3d ray(const Eigen::Vector2d& uv) { return {(uv.x() - kCx) / kFocal, (uv.y() - kCy) / kFocal, 1.0}; }
double wallDepth(const Eigen::Vector2d& uv) { return -kDistance / kNormal.dot(ray(uv)); }

cv::Mat wallDepthImage(double relative_noise) {
  cv::Mat depth(480, 640, CV_32F, cv::Scalar(0));
  cv::RNG random(3);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double z = wallDepth({u, v});
      if (z > 0 && z < 20) depth.at<float>(v, u) = static_cast<float>(z * (1 + random.gaussian(relative_noise)));
    }
  }
  return depth;
}

DepthNoise noise() {
  DepthNoise n;
  n.a = 0;
  n.b = 0.0017;
  n.c = 0;
  n.min_range = 0.2;
  n.max_range = 20;
  return n;
}

/// Exact pixel in the second view of what the first shows at uv.
Eigen::Vector2d transfer(const SE3& T_2_1, const Eigen::Vector2d& uv) {
  const Eigen::Vector3d p = T_2_1 * (ray(uv) * wallDepth(uv));
  return {kFocal * p.x() / p.z() + kCx, kFocal * p.y() / p.z() + kCy};
}

const SE3 kMotion(expSO3(Eigen::Vector3d(0.02, -0.03, 0.05)), Eigen::Vector3d(0.05, 0.02, -0.6));  // 0.6 m forward

TEST(PatchSurface, SlopeOfASlantedWall) {
  const double h = 1e-3, z = wallDepth(kPixel);
  const Eigen::Vector2d exact((z / wallDepth(kPixel + Eigen::Vector2d(h, 0)) - 1) / h,
                              (z / wallDepth(kPixel + Eigen::Vector2d(0, h)) - 1) / h);
  const PatchSurface clean = patchSurface(wallDepthImage(0), kPixel, z, noise());
  EXPECT_LT((clean.slope - exact).norm(), 0.01 * exact.norm());
  EXPECT_NEAR(clean.depthAt({6, -6}), wallDepth(kPixel + Eigen::Vector2d(6, -6)), 1e-3 * z);
  const PatchSurface noisy = patchSurface(wallDepthImage(0.0017), kPixel, z, noise());
  EXPECT_LT((noisy.slope - exact).norm(), 0.05 * exact.norm());
}

TEST(PatchSurface, FacesTheCameraWhereTheReadingsAreNoPlane) {
  cv::Mat step = wallDepthImage(0.0017);
  step.colRange(static_cast<int>(kPixel.x()) + 2, 640) *= 1.3;
  EXPECT_EQ(patchSurface(step, kPixel, wallDepth(kPixel), noise()).slope.norm(), 0);
  cv::Mat holes = wallDepthImage(0.0017);
  holes.colRange(static_cast<int>(kPixel.x()) - 2, 640).setTo(0);
  EXPECT_EQ(patchSurface(holes, kPixel, wallDepth(kPixel), noise()).slope.norm(), 0);
  EXPECT_EQ(patchSurface(cv::Mat(), kPixel, 2.0, noise()).slope.norm(), 0);
  EXPECT_EQ(patchSurface(wallDepthImage(0), Eigen::Vector2d(2, 2), 2.0, noise()).slope.norm(), 0);
  EXPECT_EQ(patchSurface(wallDepthImage(0), kPixel, 0.0, noise()).depth, 0);
}

TEST(PatchSurface, WideWhereOnePlaneIsAllOverTheWidePatch) {
  EXPECT_TRUE(patchSurface(wallDepthImage(0.0017), kPixel, wallDepth(kPixel), noise()).wide);
  cv::Mat step = wallDepthImage(0.0017);
  step.colRange(static_cast<int>(kPixel.x()) + 9, 640) *= 1.01;
  const PatchSurface narrow = patchSurface(step, kPixel, wallDepth(kPixel), noise());
  EXPECT_TRUE(narrow.known);
  EXPECT_FALSE(narrow.wide);
  cv::Mat bar = wallDepthImage(0.0017);  // no step within the bar itself, but it is not on the wall's plane
  bar.colRange(static_cast<int>(kPixel.x()) + 9, 640) *= 0.4;
  EXPECT_FALSE(patchSurface(bar, kPixel, wallDepth(kPixel), noise()).wide);
}

// A step of four sigmas is hidden in every single reading, but a patch across it drifts by pixels.
TEST(PatchSurface, AStepHiddenInTheNoiseIsNoPlane) {
  DepthNoise loud = noise();
  loud.b = 0.006;
  const cv::Mat wall = wallDepthImage(0.006);
  int known = 0, known_across = 0, tried = 0;
  for (int u = 400; u < 600; u += 15) {
    for (int v = 60; v < 420; v += 15, ++tried) {
      const Eigen::Vector2d pixel(u, v);
      cv::Mat step = wall(cv::Rect(u - 20, v - 20, 40, 40)).clone();
      step.colRange(21, 40) *= 1.024;
      known += patchSurface(wall, pixel, wallDepth(pixel), loud).known;
      known_across += patchSurface(step, {20, 20}, wallDepth(pixel), loud).known;
    }
  }
  EXPECT_GT(known, 0.99 * tried);
  EXPECT_LT(known_across, 0.2 * tried);
}

TEST(PatchSurface, WarpIsTheHomographysDerivative) {
  const double h = 1e-3;
  Eigen::Matrix2d A_cur_ref;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d d = h * Eigen::Vector2d::Unit(axis);
    A_cur_ref.col(axis) = (transfer(kMotion, kPixel + d) - transfer(kMotion, kPixel - d)) / (2 * h);
  }
  const Eigen::Matrix2d exact = A_cur_ref.inverse();
  const PatchSurface surface = patchSurface(wallDepthImage(0), kPixel, wallDepth(kPixel), noise());
  PatchWarp warp;
  ASSERT_TRUE(patchWarp(RowCamera(testCamera()), RowCamera(testCamera()), kPixel, surface, kMotion, &warp));
  EXPECT_LT((warp.A - exact).norm(), 0.01);
  PatchSurface facing = surface;
  facing.slope.setZero();
  ASSERT_TRUE(patchWarp(RowCamera(testCamera()), RowCamera(testCamera()), kPixel, facing, kMotion, &warp));
  EXPECT_GT((warp.A - exact).norm(), 0.1);  // hence the slope
  EXPECT_FALSE(patchWarp(RowCamera(testCamera()), RowCamera(testCamera()), kPixel, surface,
                         SE3(Eigen::Quaterniond::Identity(), {0, 0, -50}), &warp));
}

TEST(PatchSurface, WarpFollowsTheHomographyOverTheWholePatch) {
  const PatchSurface surface = patchSurface(wallDepthImage(0), kPixel, wallDepth(kPixel), noise());
  PatchWarp warp;
  ASSERT_TRUE(patchWarp(RowCamera(testCamera()), RowCamera(testCamera()), kPixel, surface, kMotion, &warp));
  const Eigen::Vector2d middle = transfer(kMotion, kPixel);
  double linear = 0, second = 0, mean_linear = 0, mean_second = 0;
  int count = 0;
  for (int y = -6; y <= 6; ++y) {
    for (int x = -6; x <= 6; ++x) {
      const Eigen::Vector2d d(x, y);
      // The exact homography applied after the inverse warp should return the offset in the current image.
      const auto off = [&](const Eigen::Vector2d& in_reference) -> Eigen::Vector2d {
        return transfer(kMotion, kPixel + in_reference) - middle - d;
      };
      linear = std::max(linear, off(warp.A * d).norm());
      second = std::max(second, off(warp(x, y)).norm());
      mean_linear += off(warp.A * d).x();
      mean_second += off(warp(x, y)).x();
      ++count;
    }
  }
  EXPECT_LT(second, 0.3 * linear);
  EXPECT_LT(std::abs(mean_second), 0.1 * std::abs(mean_linear));
  EXPECT_GT(std::abs(mean_linear) / count, 0.01);  // px: the shift that a linear warp mistakes for motion
}

TEST(PatchSurface, AlignmentOnASlantedWallFindsTheExactPixel) {
  cv::Mat reference(480, 640, CV_8U);
  cv::RNG random(7);
  random.fill(reference, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(reference, reference, cv::Size(), 2.0);
  cv::normalize(reference, reference, 0, 255, cv::NORM_MINMAX);
  // What the second view shows, by the plane's homography (second to first).
  const Eigen::Matrix3d K = (Eigen::Matrix3d() << kFocal, 0, kCx, 0, kFocal, kCy, 0, 0, 1).finished();
  const Eigen::Matrix3d H_2_1 = K * (kMotion.R() - kMotion.t() * kNormal.transpose() / kDistance) * K.inverse();
  const cv::Mat H = (cv::Mat_<double>(3, 3) << H_2_1(0, 0), H_2_1(0, 1), H_2_1(0, 2), H_2_1(1, 0), H_2_1(1, 1),
                     H_2_1(1, 2), H_2_1(2, 0), H_2_1(2, 1), H_2_1(2, 2));
  cv::Mat current;
  cv::warpPerspective(reference, current, H, reference.size(), cv::INTER_CUBIC);

  const Eigen::Vector2d exact = transfer(kMotion, kPixel);
  const PatchSurface surface = patchSurface(wallDepthImage(0.0017), kPixel, wallDepth(kPixel), noise());
  PatchWarp warp;
  ASSERT_TRUE(patchWarp(RowCamera(testCamera()), RowCamera(testCamera()), kPixel, surface, kMotion, &warp));
  const PatchAlignment aligned = alignPatch(reference, kPixel, warp, current, exact + Eigen::Vector2d(0.6, -0.4));
  ASSERT_TRUE(aligned.ok);
  EXPECT_LT((aligned.pixel - exact).norm(), 0.1);
}

}  // namespace
}  // namespace vip_slam
