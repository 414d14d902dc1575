// SPDX-License-Identifier: BSD-3-Clause
// Images whose K changes with the focus reach the estimator as those of one camera.
#include <gtest/gtest.h>

#include "vip_slam_ros/constant_focus.h"

namespace vip_slam::constant_focus_test {
namespace {

CameraIntrinsics camera(double focal) {
  CameraIntrinsics k;
  k.width = 320, k.height = 240;
  k.fx = k.fy = focal;
  k.cx = 159.5, k.cy = 119.5;
  k.model = DistortionModel::kRadTan;
  k.distortion = {0.1, -0.05, 0, 0};
  return k;
}

/// Light to the right of the bearing x = 0.3, dark to its left; far there, near here. Without distortion.
ImagePair look(double t, double focal) {
  ImagePair pair;
  pair.t = t;
  pair.stamp = std::uint64_t(1e9 * t + 0.5);
  pair.gray = cv::Mat(240, 320, CV_8U);
  pair.depth = cv::Mat(240, 320, CV_32F);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const bool right = (u - 159.5) / focal > 0.3;
      pair.gray.at<std::uint8_t>(v, u) = right ? 200 : 50;
      pair.depth.at<float>(v, u) = right ? 3.f : 1.f;
    }
  }
  return pair;
}

int edge(const cv::Mat& depth) {
  int u = 0;
  while (u < depth.cols && depth.at<float>(120, u) < 2) ++u;
  return u;
}

TEST(ConstantFocus, BothImagesAreBroughtToTheFirstCamera) {
  ConstantFocus focus;
  focus.start(camera(300));
  const int there = edge(look(0, 300).depth);
  for (int k = 0; k < 50; ++k) {
    const double t = 0.033 * k, focal = 300 + 0.6 * k;
    focus.add(t, camera(focal));
    ImagePair pair = look(t, focal);
    focus.apply(true, &pair);
    EXPECT_NEAR(edge(pair.depth), there, 1) << k;
    EXPECT_LT(pair.gray.at<std::uint8_t>(120, there - 3), 60) << k;
    EXPECT_GT(pair.gray.at<std::uint8_t>(120, there + 3), 190) << k;
  }
  EXPECT_EQ(focus.warped(), 49u);
  EXPECT_NE(focus.words().find("between 300.00 and 329.40"), std::string::npos) << focus.words();
}

TEST(ConstantFocus, EachStampHasTheCameraThatHolds) {
  ConstantFocus focus;
  focus.start(camera(300));
  focus.add(1.0, camera(300));
  focus.add(2.0, camera(330));
  ImagePair before = look(1.9, 300), after = look(2.0, 330), late = look(1.99, 300);
  focus.apply(true, &before);
  EXPECT_EQ(focus.warped(), 0u);
  focus.apply(true, &after);
  EXPECT_EQ(focus.warped(), 1u);
  late.depth = look(2.01, 330).depth;
  late.depth_lag = 0.02;
  focus.apply(true, &late);
  EXPECT_EQ(focus.warped(), 1u);
  EXPECT_NEAR(edge(late.depth), edge(before.depth), 1);
}

TEST(ConstantFocus, DepthOfACameraOfItsOwnIsLeftAlone) {
  ConstantFocus focus;
  focus.start(camera(300));
  focus.add(1.0, camera(330));
  ImagePair pair = look(1.0, 330);
  const cv::Mat depth = pair.depth.clone();
  focus.apply(false, &pair);
  EXPECT_EQ(focus.warped(), 1u);
  EXPECT_EQ(cv::norm(pair.depth, depth, cv::NORM_INF), 0);
}

TEST(ConstantFocus, AConstantCameraCostsNothing) {
  ConstantFocus focus;
  focus.start(camera(300));
  for (int k = 0; k < 10; ++k) focus.add(0.1 * k, camera(300));
  ImagePair pair = look(0.9, 300);
  const void* pixels = pair.gray.data;
  focus.apply(true, &pair);
  EXPECT_EQ(pair.gray.data, pixels);
  EXPECT_EQ(focus.words(), "");
}

}  // namespace
}  // namespace vip_slam::constant_focus_test
