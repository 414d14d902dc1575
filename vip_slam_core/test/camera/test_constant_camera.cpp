// SPDX-License-Identifier: BSD-3-Clause
// Images of a lens that breathes, made to look like one camera's.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/camera/constant_camera.h"

namespace vip_slam {
namespace {

CameraIntrinsics pinhole(int width, int height, double f, double cx, double cy) {
  CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = f;
  camera.cx = cx;
  camera.cy = cy;
  return camera;
}

/// What the camera sees of a smooth pattern at infinity.
cv::Mat view(const CameraIntrinsics& camera, int type = CV_8UC1) {
  cv::Mat image(camera.height, camera.width, type);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
      const double value = 128 + 60 * std::sin(18 * x) + 50 * std::cos(14 * y + 4 * x);
      if (type == CV_8UC1) image.at<uchar>(v, u) = cv::saturate_cast<uchar>(value);
      if (type == CV_16UC1) image.at<std::uint16_t>(v, u) = cv::saturate_cast<std::uint16_t>(10 * value);
      if (type == CV_32FC1) image.at<float>(v, u) = static_cast<float>(value);
    }
  return image;
}

TEST(ConstantCamera, EveryFocalLengthGivesTheSameImage) {
  const CameraIntrinsics to = pinhole(320, 240, 260, 158, 121);
  const cv::Mat expected = view(to);
  for (const double focal : {780., 800., 860., 900.}) {
    const CameraIntrinsics from = pinhole(960, 720, focal, 470.3, 366.1);
    const cv::Mat got = warpColor(view(from), from, to);
    ASSERT_EQ(got.size(), expected.size());
    // A long focal length does not fill the target: compare what both see.
    const cv::Rect inner(40, 30, 240, 180);
    EXPECT_LT(cv::norm(got(inner), expected(inner), cv::NORM_INF), 3) << focal;
    EXPECT_GT(cv::norm(view(from.scaled(320, 240))(inner), expected(inner), cv::NORM_INF), 4) << "nothing to correct";
  }
}

TEST(ConstantCamera, AConstantFocalLengthIsAPlainResize) {
  const CameraIntrinsics from = pinhole(960, 720, 800, 470, 366);
  const cv::Mat image = view(from);
  cv::Mat expected;
  cv::resize(image, expected, {320, 240}, 0, 0, cv::INTER_AREA);
  EXPECT_EQ(cv::norm(warpColor(image, from, from.scaled(320, 240)), expected, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(warpColor(image, from, from), image, cv::NORM_INF), 0);
}

TEST(ConstantCamera, DepthIsEnlargedWithoutMixingReadings) {
  for (const int type : {CV_16UC1, CV_32FC1}) {
    const CameraIntrinsics from = pinhole(64, 48, 55, 31, 23.5), to = pinhole(160, 120, 125, 80, 60);
    cv::Mat depth = cv::Mat::zeros(48, 64, type);
    depth.colRange(0, 31).setTo(1000);
    depth.colRange(31, 64).setTo(3000);
    const cv::Mat got = warpDepth(depth, from, to);
    ASSERT_EQ(got.size(), cv::Size(160, 120));
    cv::Mat metres;
    got.convertTo(metres, CV_32F);
    for (int v = 0; v < 120; ++v)
      for (int u = 0; u < 160; ++u) {
        const double source = (u - 80.) / 125 * 55 + 31, row = (v - 60.) / 125 * 55 + 23.5;
        const bool outside = source < -0.5 || source >= 63.5 || row < -0.5 || row >= 47.5;
        const float expected = outside ? 0 : source < 30.5 ? 1000 : 3000;
        ASSERT_EQ(metres.at<float>(v, u), expected) << u << " " << v;
      }
  }
}

TEST(ConstantCamera, WhatCannotBeWarpedIsRefused) {
  const CameraIntrinsics good = pinhole(64, 48, 55, 31, 23);
  CameraIntrinsics bad = good;
  bad.fx = 0;
  EXPECT_THROW(warpColor(view(good), bad, good), std::invalid_argument);
  EXPECT_THROW(warpColor(cv::Mat(), good, good), std::invalid_argument);
  EXPECT_THROW(warpDepth(view(good), good, good), std::invalid_argument);
  bad = good;
  bad.model = DistortionModel::kRadTan;
  EXPECT_THROW(warpDepth(view(good, CV_32FC1), bad, good), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
