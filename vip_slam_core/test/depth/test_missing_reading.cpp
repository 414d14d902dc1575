// SPDX-License-Identifier: BSD-3-Clause
// Values that stand for "no reading", and readings that must not pass for one.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/missing_reading.h"

namespace vip_slam {
namespace {

/// A slanted wall with a box before it, in steps of `step` metres of disparity at 1 m (0: none).
cv::Mat room(double step, double shift = 0) {
  cv::Mat depth(480, 640, CV_32F);
  cv::RNG random(5);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      double z = 2.0 + shift + 0.002 * u;
      if (u > 200 && u < 300 && v > 150) z = 1.2 + shift;
      z += random.gaussian(0.001 * z * z);
      if (step > 0) z = 1 / (step * std::round(1 / (z * step)));
      depth.at<float>(v, u) = static_cast<float>(z);
    }
  }
  return depth;
}

float found(MissingReading* missing, const cv::Mat& depth, int images) {
  for (int k = 0; k < images; ++k) missing->look(depth);
  return missing->value();
}

TEST(MissingReading, AConstantInPlaceOfNoReadingIsFound) {
  for (const float value : {4.0f, 65.535f, 0.1f}) {
    cv::Mat depth = room(0);
    cv::RNG random(7);
    for (int v = 0; v < depth.rows; ++v)
      for (int u = 0; u < depth.cols; ++u)
        if (depth.at<float>(v, u) > 3 || random.uniform(0.0, 1.0) < 0.03) depth.at<float>(v, u) = value;
    MissingReading missing;
    EXPECT_EQ(found(&missing, depth, 2), 0);
    EXPECT_EQ(found(&missing, depth, 1), value);
    EXPECT_EQ(found(&missing, room(0), 1), 0);  // once it is gone, it stands for nothing
  }
}

TEST(MissingReading, CoarseReadingsAreReadings) {
  for (const double step : {0.001, 0.005, 0.04}) {
    MissingReading missing;
    EXPECT_EQ(found(&missing, room(step), 10), 0) << step;
  }
}

// Rendered without noise a board has one value while the camera stands; it has another one as soon as it moves.
TEST(MissingReading, ABoardThatStandsFreeIsKeptWhenTheCameraMoves) {
  MissingReading missing;
  for (int k = 0; k < 20; ++k) {
    cv::Mat depth(480, 640, CV_32F, cv::Scalar(3.0 - 0.01 * k));
    depth(cv::Rect(200, 100, 150, 150)) = 1.5 - 0.01 * k;
    missing.look(depth);
    EXPECT_EQ(missing.value(), 0) << k;
  }
}

TEST(MissingReading, NothingIsAskedOfAnEmptyImage) {
  MissingReading missing;
  EXPECT_EQ(found(&missing, cv::Mat::zeros(480, 640, CV_32F), 5), 0);
  EXPECT_EQ(found(&missing, cv::Mat(480, 640, CV_32F, cv::Scalar(std::nanf(""))), 5), 0);
}

}  // namespace
}  // namespace vip_slam
