// SPDX-License-Identifier: BSD-3-Clause
// Where the image's edges lie beside those of depth: boxes before a wall, as seen by a camera that moves on.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/edge_shift.h"
#include "vip_slam_bringup/preflight/recorder.h"

namespace vip_slam {
namespace {

constexpr int kColumns = 320, kRows = 240;

struct ImagePair {
  cv::Mat grey, depth;
};

/// The i-th image of a drive past boxes whose brightness and depth are their own.
ImagePair imagePair(int i) {
  ImagePair out{cv::Mat(kRows, kColumns, CV_8U, cv::Scalar(120)), cv::Mat(kRows, kColumns, CV_32F, cv::Scalar(4.f))};
  std::mt19937 random(3);
  for (int box = 0; box < 40; ++box) {
    const float z = 1.2f + 0.06f * float(random() % 40);
    const int x = int(random() % 900) - int(float(6 * i) / z), y = int(random() % 220);
    const cv::Rect rect(x, y, 20 + int(random() % 30), 20 + int(random() % 40));
    const int shade = 20 + int(random() % 210);
    cv::rectangle(out.grey, rect, shade, cv::FILLED);
    cv::rectangle(out.depth, rect, z, cv::FILLED);
  }
  return out;
}

cv::Mat wrapped(const cv::Mat& image, int columns) {
  cv::Mat out(image.size(), image.type());
  for (int u = 0; u < image.cols; ++u) image.col(u).copyTo(out.col((u + columns) % image.cols));
  return out;
}

/// Six seconds; `change` gets each pair and its time.
template <class Change>
Recording record(const Change& change) {
  EdgeShifts shifts;
  Recording r;
  r.sensor.topics.depth = "/depth";
  r.color.sizes.emplace(kColumns, kRows);
  r.color.frame_id = r.depth.frame_id = "camera";
  for (int i = 0; i < 60; ++i) {
    ImagePair pair = imagePair(i);
    change(0.1 * i, &pair);
    shifts.add(0.1 * i, pair.grey, pair.depth);
    r.color.stamps.push_back(0.1 * i);
  }
  r.edge_shifts = shifts.record();
  return r;
}

TEST(EdgeShift, ImagesThatFitTheirDepth) {
  const Recording r = record([](double, ImagePair*) {});
  EXPECT_GT(r.edge_shifts.all.sigmas, 7);
  EXPECT_LT(r.edge_shifts.all.shift.norm(), 1.5);
  EXPECT_TRUE(checkDepthGeometry(r).empty()) << toText(checkDepthGeometry(r), false);
}

TEST(EdgeShift, ATornStretchIsFoundAtItsTime) {
  const Findings found = checkDepthGeometry(record([](double t, ImagePair* pair) {
    if (t > 1.95 && t < 3.95) pair->grey = wrapped(pair->grey, 100);
  }));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::kError);
  EXPECT_EQ(found[0].about, "colour and depth");
  EXPECT_NE(found[0].text.find("from 2.0 to 4.0 s"), std::string::npos) << found[0].text;
  EXPECT_NE(found[0].text.find("(100, "), std::string::npos) << found[0].text;
}

TEST(EdgeShift, DepthThatLiesBesideTheImage) {
  const auto aside = [](double, ImagePair* pair) { pair->depth = wrapped(pair->depth, 5); };
  Recording r = record(aside);
  Findings found = checkDepthGeometry(r);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::kWarning);
  EXPECT_NEAR(r.edge_shifts.all.shift.x(), -5, 1);
  r.depth.frame_id = "depth_camera";  // not the colour camera's: it is not registered
  found = checkDepthGeometry(r);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::kError);
  EXPECT_NE(found[0].text.find("not registered, its frame is depth_camera"), std::string::npos) << found[0].text;
}

TEST(DepthBytes, ChangedOverTheyAreNamed) {
  SensorConfig sensor;
  sensor.topics.depth = "/depth";
  sensor.depth_encoding = "16UC1";
  sensor.depth_scale = 0.001;
  for (const bool swapped : {false, true}) {
    Recorder recorder(sensor, false, 60);
    for (int i = 0; i < 20; ++i) {
      sensor_msgs::Image image;
      image.header.stamp.fromSec(1 + 0.1 * i);
      image.height = kRows;
      image.width = kColumns;
      image.step = 2 * kColumns;
      image.encoding = "16UC1";
      for (int k = 0; k < kColumns * kRows; ++k) {
        const int z = 2000 + 2 * (k % kColumns) + k % 7;
        image.data.push_back(std::uint8_t(swapped ? z >> 8 : z & 255));
        image.data.push_back(std::uint8_t(swapped ? z & 255 : z >> 8));
      }
      recorder.add("/depth", 1 + 0.1 * i, image);
    }
    recorder.finish();
    bool named = false;
    for (const Finding& f : checkImages(recorder.recording())) {
      named |= f.severity == Severity::kError && f.text.find("is_bigendian") != std::string::npos;
    }
    EXPECT_EQ(named, swapped);
  }
}

}  // namespace
}  // namespace vip_slam
