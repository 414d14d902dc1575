// SPDX-License-Identifier: BSD-3-Clause
// RVL: words written out by hand, images there and back, and damaged data.
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_core/depth/rvl.h"

namespace vip_slam {
namespace {

cv::Mat roundTrip(const cv::Mat& depth) {
  const std::vector<std::uint8_t> bytes = encodeRvl(depth);
  EXPECT_EQ(bytes.size() % 4, 0u);
  return decodeRvl(bytes.data(), bytes.size(), depth.size());
}

TEST(Rvl, AnImageWrittenOutByHand) {
  // 0 0 | 1000 1001 999: a run of 2 zeros, of 3 values with steps 1000, 1, -2, as 2000, 2, 3 in zigzag order.
  // 2000 is 3720 in digits of three bits: nibbles 8, a, f, 3. So 2 3 8 a f 3 2 3.
  const cv::Mat depth = (cv::Mat_<std::uint16_t>(1, 5) << 0, 0, 1000, 1001, 999);
  const std::vector<std::uint8_t> bytes = {0x23, 0xf3, 0x8a, 0x23};
  EXPECT_EQ(encodeRvl(depth), bytes);
  EXPECT_EQ(cv::norm(decodeRvl(bytes.data(), bytes.size(), {5, 1}), depth, cv::NORM_INF), 0);
}

TEST(Rvl, ImagesComeBack) {
  cv::RNG rng(5);
  cv::Mat noise(48, 64, CV_16UC1), holes;
  rng.fill(noise, cv::RNG::UNIFORM, 0, 65536);
  holes = noise.clone();
  holes.setTo(0, noise < 40000);
  cv::Mat ramp(48, 64, CV_16UC1);
  for (int v = 0; v < ramp.rows; ++v)
    for (int u = 0; u < ramp.cols; ++u) ramp.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(900 + 3 * u + v);
  for (const cv::Mat& depth :
       {noise, holes, ramp, cv::Mat(cv::Mat::zeros(48, 64, CV_16UC1)), cv::Mat(1, 1, CV_16UC1, cv::Scalar(65535)),
        cv::Mat(noise, cv::Rect(5, 3, 20, 30)), cv::Mat(cv::Mat(48, 64, CV_16UC1, cv::Scalar(1)))})
    EXPECT_EQ(cv::norm(roundTrip(depth), depth, cv::NORM_INF), 0);
  EXPECT_LT(encodeRvl(ramp).size(), ramp.total());  // half of the raw size and less
  EXPECT_THROW(encodeRvl(cv::Mat(4, 4, CV_8UC1)), std::invalid_argument);
}

TEST(Rvl, DamagedDataAreRefused) {
  cv::Mat depth(24, 32, CV_16UC1);
  cv::RNG rng(7);
  rng.fill(depth, cv::RNG::UNIFORM, 500, 4000);
  const std::vector<std::uint8_t> bytes = encodeRvl(depth);
  for (std::size_t cut = 0; cut + 4 <= bytes.size(); ++cut)
    EXPECT_THROW(decodeRvl(bytes.data(), cut, depth.size()), std::invalid_argument) << cut;
  EXPECT_THROW(decodeRvl(bytes.data(), bytes.size(), {16, 24}), std::invalid_argument) << "runs longer than the image";
  EXPECT_THROW(decodeRvl(bytes.data(), bytes.size(), {0, 24}), std::invalid_argument);
  // Whatever the bytes, it decodes or refuses.
  int unnoticed = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<std::uint8_t> damaged = bytes;
    for (int k = 0; k < 3; ++k) damaged[rng.uniform(0, static_cast<int>(bytes.size()))] ^= 1 << rng.uniform(0, 8);
    try {
      unnoticed += cv::norm(decodeRvl(damaged.data(), damaged.size(), depth.size()), depth, cv::NORM_INF) == 0;
    } catch (const std::invalid_argument&) {
    }
  }
  EXPECT_LE(unnoticed, 3);
}

}  // namespace
}  // namespace vip_slam
