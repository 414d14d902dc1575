// SPDX-License-Identifier: BSD-3-Clause
// Depth in the geometry of the colour camera without its lens, beside a colour image with its lens: the truth is a
// rendered scene, a panel before a slanted wall, seen by both.
#include <gtest/gtest.h>

#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam {
namespace {

/// Lens of a wide colour camera: tens of pixels at the corners.
SensorConfig sensor() {
  SensorConfig config;
  CameraIntrinsics& k = config.camera;
  k.width = 640, k.height = 480;
  k.fx = 500, k.fy = 505, k.cx = 322, k.cy = 237;
  k.model = DistortionModel::kRadTan;
  k.distortion = {-0.16, 0.05, 0.0008, -0.0005, 0.0};
  config.depth_registered = true;
  config.depth_undistorted = true;
  return config;
}

/// Depth z along the ray (x, y, 1): a panel at 1 m before a wall that is 3 m away at the middle.
float depthAlong(const Eigen::Vector2d& xy) {
  if (xy.x() > -0.56 && xy.x() < -0.4 && xy.y() > 0.3 && xy.y() < 0.42) return 1.0f;
  return static_cast<float>(3.0 / (1 - 0.2 * xy.x() + 0.1 * xy.y()));
}

cv::Mat seenBy(const CameraIntrinsics& k) {
  const auto camera = makeCamera(k);
  cv::Mat depth(k.height, k.width, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < k.height; ++v)
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector2d xy;
      if (camera->undistort(Eigen::Vector2d(u, v), &xy)) depth.at<float>(v, u) = depthAlong(xy);
    }
  return depth;
}

/// Pixels that differ from the truth by more than a neighbour's depth does.
int wrongPixels(const cv::Mat& depth, const cv::Mat& truth) {
  int wrong = 0;
  for (int v = 0; v < truth.rows; ++v)
    for (int u = 0; u < truth.cols; ++u) wrong += std::abs(depth.at<float>(v, u) - truth.at<float>(v, u)) > 0.005;
  return wrong;
}

TEST(DepthToColour, UndistortedDepthIsBroughtToTheLens) {
  const SensorConfig config = sensor();
  const cv::Mat published = seenBy(pinholeOf(config.camera)), truth = seenBy(config.camera);
  const int as_published = wrongPixels(published, truth);
  const DepthToColour to_colour(config);
  EXPECT_FALSE(to_colour.asPublished());
  const cv::Mat depth = to_colour(published);
  ASSERT_EQ(depth.size(), truth.size());
  int outside = 0, wrong = 0, inside = 0;
  for (int v = 0; v < truth.rows; ++v)
    for (int u = 0; u < truth.cols; ++u) {
      if (depth.at<float>(v, u) == 0) {
        ++outside;  // beyond the border of the depth image
        continue;
      }
      ++inside;
      // Within a pixel: as one of the neighbours of the truth.
      bool like = false;
      for (int y = std::max(0, v - 1); y <= std::min(truth.rows - 1, v + 1); ++y)
        for (int x = std::max(0, u - 1); x <= std::min(truth.cols - 1, u + 1); ++x)
          like |= std::abs(depth.at<float>(v, u) - truth.at<float>(y, x)) < 0.005;
      wrong += !like;
    }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(as_published, 5000);        // the lens matters here
  EXPECT_GT(inside, 0.85 * 640 * 480);  // a barrel sees more than the camera without its lens
  EXPECT_EQ(inside + outside, 640 * 480);
}

TEST(DepthToColour, NothingIsDoneWithoutNeed) {
  SensorConfig config = sensor();
  const cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(2));
  config.camera = pinholeOf(config.camera);
  EXPECT_TRUE(DepthToColour(config).asPublished());
  EXPECT_EQ(DepthToColour(config)(depth).data, depth.data);
  config = sensor();
  config.camera.distortion.assign(5, 0.0);
  EXPECT_TRUE(DepthToColour(config).asPublished());
  config = sensor();
  config.depth_undistorted = false;
  EXPECT_TRUE(DepthToColour(config).asPublished());
}

TEST(DepthToColour, AnotherSizeIsRefusedWithBoth) {
  const DepthToColour to_colour(sensor());
  try {
    to_colour(cv::Mat(240, 320, CV_32FC1, cv::Scalar(1)));
    ADD_FAILURE() << "was taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("320x240"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("640x480"), std::string::npos) << error.what();
  }
  SensorConfig separate = sensor();
  separate.depth_registered = false;
  separate.depth_undistorted = false;
  EXPECT_THROW(DepthToColour{separate}, std::invalid_argument);  // no depth camera
}

TEST(DepthToColour, DistortionInPixels) {
  CameraIntrinsics k = sensor().camera;
  EXPECT_EQ(largestDistortion(pinholeOf(k)), 0);
  k.distortion = {0.01, 0, 0, 0};
  // Far from the middle: r = |(322, 237) / 500|, moved by k1 r^3 f.
  const double r = std::hypot(322 / 500.0, 242 / 505.0);
  EXPECT_NEAR(largestDistortion(k), 0.01 * r * r * r * 502, 0.2);
  k.model = DistortionModel::kEquidistant;
  k.distortion = {0, 0, 0, 0};
  EXPECT_GT(largestDistortion(k), 40);  // a fisheye is never a pinhole
}

}  // namespace
}  // namespace vip_slam
