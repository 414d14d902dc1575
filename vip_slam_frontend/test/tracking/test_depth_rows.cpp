// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "distorted_camera.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_frontend/tracking/depth_rows.h"

namespace vip_slam {
namespace {

std::shared_ptr<const CameraModel> smallCamera() { return distortedCamera(320, 240, 250); }

/// Level, turning at 1.9 rad/s and moving at 1.4 m/s.
RowPoses motion() {
  NavState nav;
  nav.v_W = {0.9, -0.8, 0.7};
  ImuSample s;
  s.gyro = {1.5, -1.0, 0.6};
  s.accel = gravityVector();
  return RowPoses(Readout::around(kReadout), nav, {s}, SE3());
}

/// Floor and two walls seen from a pose relative to the stamp; nearest hit of a pixel's ray, z in that pose.
double nearest(const Eigen::Vector2d& uv, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  const Eigen::Vector3d ray = smallCamera()->unproject(uv, 1.0), way = R * ray;
  double z = 0;
  const Eigen::Vector4d planes[] = {{0, 1, 0, -1.3}, {0.3, 0, 1, -3.5}, {-1, 0, 0.1, -1.0}};
  for (const Eigen::Vector4d& plane : planes) {
    const double hit = -(plane.head<3>().dot(t) + plane.w()) / plane.head<3>().dot(way);
    if (hit > 0.1 && (z == 0 || hit < z)) z = hit;
  }
  return z;
}

cv::Mat image(const RowPoses* rows) {
  cv::Mat depth(240, 320, CV_32FC1);
  for (int v = 0; v < 240; ++v) {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
    if (rows) rows->at((v + 0.5) / 240, &R, &t);
    for (int u = 0; u < 320; ++u) depth.at<float>(v, u) = static_cast<float>(nearest({u, v}, R, t));
  }
  return depth;
}

/// Share of the valid pixels that are farther than `limit` (of their depth) from `truth`.
double wrongShare(const cv::Mat& depth, const cv::Mat& truth, double limit) {
  int valid = 0, wrong = 0;
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const float z = depth.at<float>(v, u), expected = truth.at<float>(v, u);
      if (!(z > 0)) continue;
      ++valid;
      wrong += std::abs(z - expected) > limit * expected;
    }
  }
  return double(wrong) / valid;
}

TEST(DepthRows, ShowsWhatTheCameraAtTheStampSees) {
  const RowPoses rows = motion();
  const cv::Mat read = image(&rows), truth = image(nullptr);
  const cv::Mat result = DepthRows(smallCamera()).atStamp(read, rows);
  EXPECT_GT(wrongShare(read, truth, 1e-3), 0.5);
  // The remaining ones are at the edges between the planes.
  EXPECT_LT(wrongShare(result, truth, 1e-3), 0.01);
  EXPECT_GT(cv::countNonZero(result), 0.9 * 320 * 240);
}

TEST(DepthRows, HolesStayHolesAndNothingIsMadeUp) {
  const RowPoses rows = motion();
  cv::Mat read = image(&rows);
  read(cv::Rect(100, 80, 60, 50)) = 0.f;
  read(cv::Rect(200, 20, 40, 40)) = std::nanf("");
  const cv::Mat result = DepthRows(smallCamera()).atStamp(read, rows);
  EXPECT_LT(wrongShare(result, image(nullptr), 1e-2), 0.01);
  EXPECT_EQ(cv::countNonZero(result != result), 0);
  EXPECT_LT(cv::countNonZero(result), 320 * 240 - 4000);
  const cv::Mat nothing = cv::Mat::zeros(240, 320, CV_32FC1);
  EXPECT_EQ(cv::countNonZero(DepthRows(smallCamera()).atStamp(nothing, rows)), 0);
}

TEST(DepthRows, ANearSpeckCostsItselfAndNotTheColumnBelowIt) {
  const RowPoses rows = motion();
  const cv::Mat whole = image(&rows);
  const int before = cv::countNonZero(DepthRows(smallCamera()).atStamp(whole, rows));
  for (const float z : {0.002f, 0.005f, 0.01f, 0.02f}) {
    for (const int row : {10, 60, 115, 180}) {
      cv::Mat read = whole.clone();
      read.rowRange(row, row + 3) = z;
      const cv::Mat result = DepthRows(smallCamera()).atStamp(read, rows);
      EXPECT_GT(cv::countNonZero(result), before - 6 * 320) << z << " m in row " << row;
    }
  }
}

TEST(DepthRows, AtRestNothingChanges) {
  NavState still;
  ImuSample s;
  s.accel = gravityVector();
  const cv::Mat truth = image(nullptr);
  const cv::Mat result =
      DepthRows(smallCamera()).atStamp(truth, RowPoses(Readout::around(kReadout), still, {s}, SE3()));
  EXPECT_LT(cv::norm(result, truth, cv::NORM_INF), 1e-3);
}

}  // namespace
}  // namespace vip_slam
