// SPDX-License-Identifier: BSD-3-Clause
// Depth image shifted against the colour image: the depth at a pixel belongs to a neighbouring one.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/depth_shift.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

constexpr double kFocal = 200, kCx = 80, kCy = 60;
const Eigen::Vector3d kSlanted(-0.5, 0.3, 0.8);

/// Depth of the plane n^T p = 2 at pixel + `beside`.
float planeAt(double u, double v, const Eigen::Vector2d& beside = Eigen::Vector2d::Zero()) {
  const Eigen::Vector3d ray((u + beside.x() - kCx) / kFocal, (v + beside.y() - kCy) / kFocal, 1.0);
  return static_cast<float>(2.0 / kSlanted.dot(ray));
}

cv::Mat planeImage(const Eigen::Vector2d& beside) {
  cv::Mat depth(120, 160, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) depth.at<float>(v, u) = planeAt(u, v, beside);
  }
  return depth;
}

TEST(DepthShift, BringsASurfaceBackToItsPixels) {
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(2, 0), Eigen::Vector2d(-1.3, 0.6), Eigen::Vector2d(0.25, -3.75)}) {
    const cv::Mat shifted = shiftedDepth(planeImage(-px), px);
    for (int v = 5; v < 115; ++v) {
      for (int u = 5; u < 155; ++u) ASSERT_NEAR(shifted.at<float>(v, u), planeAt(u, v), 1e-4f) << u << ' ' << v;
    }
  }
}

TEST(DepthShift, TakesTheNearestReadingAtEdgesAndNoneBeyondTheBorder) {
  cv::Mat depth(20, 20, CV_32FC1, cv::Scalar(1.0));
  depth.colRange(10, 20).setTo(2.0);
  depth.at<float>(5, 5) = 0;
  depth.at<float>(15, 5) = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat shifted = shiftedDepth(depth, {1.4, 0});
  for (int v = 0; v < 19; ++v) {
    for (int u = 0; u < 18; ++u) {
      const float z = shifted.at<float>(v, u), expected = u < 9 ? 1.f : 2.f;
      if (u == 4 && (v == 5 || v == 15)) {
        EXPECT_FALSE(z > 0) << v;
      } else {
        EXPECT_EQ(z, expected) << u << ' ' << v;
      }
    }
    EXPECT_EQ(shifted.at<float>(v, 19), 0.f);
  }
  EXPECT_EQ(cv::countNonZero(shiftedDepth(depth, {30, -40})), 0);
}

// Correcting a keyframe that was read with another shift gives what the right shift would have given.
TEST(DepthShift, AKeyframeFollowsWhatIsFoundOutLater) {
  const DepthShift before{{0.5, -0.25}, {0.5 / kFocal, -0.25 / kFocal}},
      after{{2.5, -1.0}, {2.5 / kFocal, -1.0 / kFocal}};
  // Read as if the image were shifted by `before`, which it is by `after`.
  const Eigen::Vector2d rest = before.px - after.px;
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->frame.camera_correction.shift = before;
  DepthGrid& grid = keyframe->frame.depth_grid;
  grid = {8, 4, 20, 15, {}};
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) grid.z.push_back(planeAt(grid.pixel(c, r).x(), grid.pixel(c, r).y(), rest));
  }
  grid.z[7 * 20 + 10] = 0;      // a hole
  const int step = 3 * 20 + 4;  // an object in front of the plane
  grid.z[static_cast<std::size_t>(step)] = 1.0f;
  for (const Eigen::Vector2f& pixel : {Eigen::Vector2f(61.5f, 90.25f), Eigen::Vector2f(120, 40)}) {
    Feature f;
    f.pixel = pixel;
    f.depth = planeAt(pixel.x(), pixel.y(), rest);
    keyframe->frame.features.push_back(f);
  }
  PlaneObservation observation;
  observation.camera_correction.shift = before;
  observation.weight_scale = 1;
  for (const Eigen::Vector2d& uv : {Eigen::Vector2d(20, 30), Eigen::Vector2d(150, 100), Eigen::Vector2d(77, 3)}) {
    const float z = planeAt(uv.x(), uv.y(), rest);
    const Eigen::Vector3d ray((uv.x() - kCx) / kFocal, (uv.y() - kCy) / kFocal, 1.0);
    observation.points.push_back({(z * ray).cast<float>(), 0.01f});
    EXPECT_GT(std::abs(kSlanted.dot(z * ray) - 2.0), 0.008);
  }

  CameraCorrection correction;
  correction.shift = after;
  const KeyframePtr corrected = withCameraCorrection(keyframe, correction);
  for (const Feature& f : corrected->frame.features) EXPECT_NEAR(f.depth, planeAt(f.pixel.x(), f.pixel.y()), 5e-4f);
  const DepthGrid& moved = corrected->frame.depth_grid;
  int same = 0;
  for (int r = 1; r + 1 < moved.rows; ++r) {
    for (int c = 1; c + 1 < moved.cols; ++c) {
      const float truth = planeAt(moved.pixel(c, r).x(), moved.pixel(c, r).y());
      const float z = moved.at(c, r);
      if (std::abs(c - 10) + std::abs(r - 7) <= 1 || std::abs(c - 4) + std::abs(r - 3) <= 1) {
        same += z == grid.at(c, r);
      } else {
        ASSERT_NEAR(z, truth, 1e-3f) << c << ' ' << r;
      }
    }
  }
  EXPECT_EQ(moved.at(10, 7), 0.f);
  EXPECT_EQ(moved.at(4, 3), 1.f);
  EXPECT_EQ(same, 2);  // adjacent nodes still have one valid slope
  setCameraCorrection(correction, &observation);
  for (const PlaneSample& p : observation.points) EXPECT_NEAR(kSlanted.dot(p.p_C.cast<double>()), 2.0, 1e-4);
  Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
  for (const PlaneSample& point : observation.points) {
    const Eigen::Vector4d p = point.p_C.cast<double>().homogeneous();
    G += p * p.transpose() / (0.01 * 0.01);
  }
  EXPECT_LT((observation.G - G).norm(), 1e-5 * G.norm());
}

}  // namespace
}  // namespace vip_slam
