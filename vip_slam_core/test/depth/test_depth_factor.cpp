// SPDX-License-Identifier: BSD-3-Clause
// The unit of depth images, told from their values.
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_core/depth/depth_factor.h"

namespace vip_slam {
namespace {

/// A plane from `near` to `far` metres, measured in steps of `step` metres, written with `factor` units per metre.
std::vector<cv::Mat> images(double near, double far, double step, double factor) {
  cv::Mat image(120, 160, CV_16UC1);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const double z = near + (far - near) * (v * image.cols + u) / double(image.total());
      image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(std::round(z / step) * step * factor));
    }
  image.rowRange(0, 8).setTo(0);
  image.rowRange(8, 12).setTo(65535);
  return {image, image};
}

TEST(DepthFactors, AreToldByTheValues) {
  const auto expect = [](const std::vector<cv::Mat>& raw, double factor, bool certain, const char* words) {
    const DepthFactor guess = guessDepthFactor(raw);
    EXPECT_EQ(guess.units_per_metre, factor) << guess.reason;
    EXPECT_EQ(guess.certain, certain) << guess.reason;
    EXPECT_NE(guess.reason.find(words), std::string::npos) << guess.reason;
  };
  expect(images(0.5, 4.0, 0.001, 5000), 5000, true, "multiples of 5");
  expect(images(0.5, 1.2, 0.001, 5000), 5000, true, "multiples of 5");
  expect(images(0.8, 4.0, 0.0002, 5000), 5000, true, "beyond 13 m");
  expect(images(0.4, 2.0, 0.001, 1000), 1000, true, "as 1/5000 m the median were 0.2");
  expect(images(0.5, 5.0, 0.001, 1000), 1000, false, "as 1/5000 m");
  expect(images(0.5, 2.0, 0.0002, 5000), 5000, false, "in millimetres the median were 6.5 m; so it is 1.31 m");
  expect({}, 5000, false, "no reading");
  expect({cv::Mat(20, 20, CV_16UC1, cv::Scalar(0))}, 5000, false, "no reading");
  // One wall at 1.6 m in millimetres has few values, all of them multiples of 5 by chance.
  expect({cv::Mat(20, 20, CV_16UC1, cv::Scalar(1600))}, 1000, false, "as 1/5000 m");
  EXPECT_THROW(guessDepthFactor({cv::Mat(20, 20, CV_8UC1)}), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
