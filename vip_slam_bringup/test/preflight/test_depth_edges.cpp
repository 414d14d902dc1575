// SPDX-License-Identifier: BSD-3-Clause
// Depth with and without the lens of the colour camera is told apart by its edges, on a rendered scene: panels before a
// wall, all textured.
#include <gtest/gtest.h>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/depth_edges.h"
#include "vip_slam_core/sensor/depth_to_colour.h"

namespace vip_slam {
namespace {

CameraIntrinsics lens(double k1) {
  CameraIntrinsics k;
  k.width = 640, k.height = 480;
  k.fx = k.fy = 480, k.cx = 319.5, k.cy = 239.5;
  k.model = DistortionModel::kRadTan;
  k.distortion = {k1, 0, 0, 0, 0};
  return k;
}

/// Along the ray (x, y, 1), moved sideways by `shift`: panels of 0.1 in a grid of 0.3, nearer than the wall.
bool onPanel(const Eigen::Vector2d& xy, double shift) {
  const auto within = [](double a) { return a - 0.3 * std::floor(a / 0.3) < 0.1; };
  return within(xy.x() + shift) && within(xy.y() + 0.7 * shift);
}

cv::Mat depthSeenBy(const CameraIntrinsics& k, double shift) {
  const auto camera = makeCamera(k);
  cv::Mat depth(k.height, k.width, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < k.height; ++v)
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector2d xy;
      if (camera->undistort(Eigen::Vector2d(u, v), &xy)) depth.at<float>(v, u) = onPanel(xy, shift) ? 1.2f : 3.0f;
    }
  return depth;
}

/// `contrast`: grey levels between panel and wall; texture of +-15 on both.
cv::Mat greySeenBy(const CameraIntrinsics& k, double shift, double contrast, cv::RNG* random) {
  const cv::Mat depth = depthSeenBy(k, shift);
  cv::Mat noise(k.height, k.width, CV_32FC1), grey(k.height, k.width, CV_32FC1, cv::Scalar(110));
  random->fill(noise, cv::RNG::UNIFORM, -15, 15);
  grey.setTo(110 + contrast, depth < 2);
  cv::Mat out;
  cv::Mat(grey + noise).convertTo(out, CV_8UC1);
  return out;
}

/// What check_bag says of a recording with that lens, depth published with the lens or without it.
Findings found(double k1, bool published_without_lens, bool sensor_file_says_so, double contrast = 60,
               bool plain_depth_info = false) {
  const CameraIntrinsics colour = lens(k1);
  DepthEdges edges(colour);
  cv::RNG random(5);
  for (int i = 0; i < 8; ++i) {
    const double shift = 0.017 * i;
    edges.add(greySeenBy(colour, shift, contrast, &random),
              depthSeenBy(published_without_lens ? pinholeOf(colour) : colour, shift));
  }
  Recording r;
  r.sensor.topics.depth = "/depth";
  r.sensor.depth_registered = true;
  r.sensor.depth_undistorted = sensor_file_says_so;
  r.sensor.intrinsics_from_camera_info = true;
  r.color_camera = colour;
  r.depth_camera = plain_depth_info ? pinholeOf(colour) : colour;
  r.depth_edges = edges.record();
  return checkDepthGeometry(r);
}

TEST(DepthEdges, DepthWithoutTheLensIsFound) {
  const Findings findings = found(-0.08, true, false);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::kWarning);
  EXPECT_NE(findings[0].advice.find("depth/undistorted: true"), std::string::npos) << findings[0].advice;
}

TEST(DepthEdges, AWrongKeyIsFoundTheOtherWayAbout) {
  const Findings findings = found(-0.08, false, true);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::kWarning);
  EXPECT_NE(findings[0].advice.find("depth/undistorted: false"), std::string::npos) << findings[0].advice;
}

TEST(DepthEdges, WhatTheSensorFileSaysIsConfirmed) {
  for (const bool without : {false, true}) {
    const Findings findings = found(0.06, without, without);
    ASSERT_EQ(findings.size(), 1u) << without;
    EXPECT_EQ(findings[0].severity, Severity::kGood) << findings[0].text;
  }
}

TEST(DepthEdges, EdgesOutweighTheCameraInfo) {
  // Some drivers' calibration of the depth image is not to be trusted.
  const Findings findings = found(-0.08, false, false, 60, true);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::kGood) << findings[0].text;
}

TEST(DepthEdges, WithoutImageEdgesTheCameraInfoTells) {
  Findings findings = found(-0.08, true, false, 0, true);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].about, "depth camera_info");
  EXPECT_EQ(findings[0].severity, Severity::kWarning);
  EXPECT_TRUE(found(-0.08, true, false, 0, false).empty());  // nothing tells, nothing is said
}

TEST(DepthEdges, ALensThatHardlyDistortsIsNotAskedAbout) { EXPECT_TRUE(found(-0.002, true, false).empty()); }

}  // namespace
}  // namespace vip_slam
