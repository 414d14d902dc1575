// SPDX-License-Identifier: BSD-3-Clause
// What the recorder finds in depth itself: a unit that changes, a distance that stands for "no reading".
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"

namespace vip_slam {
namespace {

class DepthReadings : public testing::Test {
 protected:
  static constexpr int kColumns = 320, kRows = 240;
  void SetUp() override {
    sensor_.topics.color = "/color";
    sensor_.topics.depth = "/depth";
    sensor_.color_encoding = "mono8";
    sensor_.depth_encoding = "16UC1";
    sensor_.depth_scale = 0.001;
    sensor_.intrinsics_from_camera_info = false;
    sensor_.camera.width = kColumns, sensor_.camera.height = kRows;
    sensor_.camera.fx = sensor_.camera.fy = 250;
    sensor_.camera.cx = 0.5 * (kColumns - 1), sensor_.camera.cy = 0.5 * (kRows - 1);
  }
  /// Two seconds before two walls, the camera moving along them; `written`: the millimetres of a pixel at (u, v) whose
  /// depth is z, at the time t.
  Recording record(const std::function<double(double z, double t, int u, int v)>& written) const {
    cv::Mat texture(3 * kRows, 3 * kColumns, CV_8U);
    cv::RNG random(3);
    random.fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, {0, 0}, 2.5);
    cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
    Recorder recorder(sensor_, false, 60);
    for (int i = 0; i < 60; ++i) {
      const double t = i / 30.0, beside = 0.2 * t;  // m
      sensor_msgs::Image grey;
      grey.header.stamp.fromSec(1 + t);
      grey.header.frame_id = "camera";
      grey.width = kColumns, grey.height = kRows;
      sensor_msgs::Image depth = grey;
      grey.encoding = "mono8", grey.step = kColumns;
      depth.encoding = "16UC1", depth.step = 2 * kColumns;
      for (int v = 0; v < kRows; ++v) {
        for (int u = 0; u < kColumns; ++u) {
          const double z = v < kRows / 2 ? 2.4 : 1.2;
          const double moved = u + 250 * beside / z;  // of the texture that is seen
          const int left = int(moved), row = v < kRows / 2 ? v : v + kRows;
          const double share = moved - left;
          grey.data.push_back(std::uint8_t((1 - share) * texture.at<std::uint8_t>(row, left) +
                                           share * texture.at<std::uint8_t>(row, left + 1)));
          const int mm = int(written(1000 * z + random.gaussian(2), t, u, v));
          depth.data.push_back(std::uint8_t(mm & 255));
          depth.data.push_back(std::uint8_t(mm >> 8));
        }
      }
      recorder.add("/color", 1 + t, grey);
      if (i < no_depth_from_ || i >= no_depth_from_ + 3) recorder.add("/depth", 1 + t, depth);
    }
    recorder.finish();
    return recorder.recording();
  }
  SensorConfig sensor_;
  int no_depth_from_ = 60;  ///< three images without depth from this one on
};

TEST_F(DepthReadings, AUnitThatChangesIsNamedWithItsTime) {
  for (const double factor : {2.0, 0.8, 1.0}) {
    const Recording r = record([&](double z, double t, int, int) { return t > 0.99 ? factor * z : z; });
    ASSERT_EQ(r.depth_unit_changes.size(), factor == 1 ? 0u : 1u) << factor;
    if (factor == 1) continue;
    EXPECT_NEAR(r.depth_unit_changes[0].factor, factor, 0.01 * factor);
    EXPECT_NEAR(r.depth_unit_changes[0].t, 2.0, 0.01);
    // The motion is measured in the first unit throughout.
    for (const RotationStep& step : r.rotations) {
      ASSERT_TRUE(step.T_now_before);
      EXPECT_NEAR(step.T_now_before->t().norm(), 0.2 / 30, 0.001) << step.t1;
    }
    bool named = false;
    for (const Finding& f : checkImages(r)) named |= f.text.find("its unit is set anew at 1.0 s") != std::string::npos;
    EXPECT_TRUE(named);
  }
}

TEST_F(DepthReadings, ImagesWithoutDepthAfterTheUnitHasChanged) {
  no_depth_from_ = 45;
  const Recording r = record([&](double z, double t, int, int) { return t > 0.99 ? 2 * z : z; });
  EXPECT_EQ(r.depth_unit_changes.size(), 1u);
  EXPECT_GT(r.rotations.size(), 50u);
}

TEST_F(DepthReadings, ADistanceThatStandsForNoReadingIsNamedAndLeftOut) {
  const Recording r =
      record([](double z, double, int u, int v) { return u / 20 % 3 == 0 && v / 20 % 2 == 0 ? 4000.0 : z; });
  EXPECT_NEAR(r.missing_reading, 4, 1e-6);
  for (std::size_t i = 1; i < r.depths.size(); ++i) EXPECT_LT(r.depths[i].spread, 1.5);
  EXPECT_EQ(record([](double z, double, int, int) { return z; }).missing_reading, 0);
}

}  // namespace
}  // namespace vip_slam
