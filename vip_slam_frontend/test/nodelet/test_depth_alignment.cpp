// SPDX-License-Identifier: BSD-3-Clause
// Depth of an unexpected size is reported and left out.
#include <gtest/gtest.h>

#include "depth_alignment.h"

namespace vip_slam {
namespace {

CameraIntrinsics camera(int width, int height) {
  CameraIntrinsics k;
  k.width = width;
  k.height = height;
  k.fx = k.fy = width;
  k.cx = 0.5 * (width - 1);
  k.cy = 0.5 * (height - 1);
  return k;
}

SensorConfig sensor(bool registered) {
  SensorConfig config;
  config.topics.color = "/color";
  config.topics.depth = "/depth";
  config.camera = camera(64, 48);
  config.depth_camera = camera(32, 24);
  config.depth_registered = registered;
  return config;
}

cv::Mat wall(int width, int height) { return cv::Mat(height, width, CV_32FC1, cv::Scalar(2)); }

TEST(DepthAlignment, DepthOfItsOwnCameraIsRegistered) {
  const DepthAlignment alignment(sensor(false));
  std::string problem = "of the image before";
  const cv::Mat depth = alignment.align(wall(32, 24), {64, 48}, &problem);
  EXPECT_EQ(problem, "");
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  EXPECT_FLOAT_EQ(depth.at<float>(24, 32), 2);
}

TEST(DepthAlignment, DepthOfAnotherSizeIsNamedAndLeftOut) {
  const DepthAlignment alignment(sensor(false));
  std::string problem;
  cv::Mat depth;
  ASSERT_NO_THROW(depth = alignment.align(wall(16, 12), {64, 48}, &problem));
  EXPECT_TRUE(depth.empty());
  EXPECT_NE(problem.find("/depth"), std::string::npos) << problem;
  EXPECT_NE(problem.find("16x12"), std::string::npos) << problem;
  EXPECT_NE(problem.find("32x24"), std::string::npos) << problem;
}

TEST(DepthAlignment, RegisteredDepthIsComparedWithTheColourImage) {
  const DepthAlignment alignment(sensor(true));
  std::string problem;
  EXPECT_EQ(alignment.align(wall(64, 48), {64, 48}, &problem).size(), cv::Size(64, 48));
  EXPECT_EQ(problem, "");
  alignment.align(wall(32, 24), {64, 48}, &problem);
  EXPECT_NE(problem.find("/depth is 32x24, /color is 64x48"), std::string::npos) << problem;
  alignment.align({}, {64, 48}, &problem);
  EXPECT_EQ(problem, "");
}

}  // namespace
}  // namespace vip_slam
