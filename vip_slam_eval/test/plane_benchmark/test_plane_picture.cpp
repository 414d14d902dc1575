// SPDX-License-Identifier: BSD-3-Clause
// Planes drawn over an image: where they are, and nowhere else.
#include <gtest/gtest.h>

#include "vip_slam_eval/plane_benchmark/plane_picture.h"

namespace vip_slam {
namespace {

std::shared_ptr<const CameraModel> camera() {
  CameraIntrinsics k;
  k.width = 160, k.height = 120, k.fx = k.fy = 120, k.cx = 79.5, k.cy = 59.5;
  return makeCamera(k);
}

// Vertical, two metres in front of the camera (which looks along z of the map), right of the middle, with a hole.
PlaneEstimate wall() {
  PlaneEstimate plane;
  plane.id = 3;
  plane.kind = PlaneKind::kVertical;
  plane.plane = Plane::fromPointNormal({0, 0, 2}, {0, 0, -1});
  PlanePolygon polygon;
  polygon.outer = {{0, -0.8, 2}, {1.2, -0.8, 2}, {1.2, 0.8, 2}, {0, 0.8, 2}};
  polygon.holes.push_back({{0.4, -0.2, 2}, {0.8, -0.2, 2}, {0.8, 0.2, 2}, {0.4, 0.2, 2}});
  plane.polygons.push_back(polygon);
  return plane;
}

cv::Point pixel(double x, double y) { return {int(std::lround(79.5 + 60 * x)), int(std::lround(59.5 + 60 * y))}; }

TEST(PlanePicture, PaintsTheAreaAndLeavesTheRest) {
  const cv::Mat gray(120, 160, CV_8UC1, cv::Scalar(100));
  const cv::Vec3b bare(100, 100, 100);
  const cv::Mat picture = drawPlanes(gray, {}, *camera(), SE3(), {wall()});
  ASSERT_EQ(CV_8UC3, picture.type());
  EXPECT_NE(bare, picture.at<cv::Vec3b>(pixel(0.2, 0.6)));
  EXPECT_EQ(bare, picture.at<cv::Vec3b>(pixel(0.44, -0.16))) << "the hole, beside the id";
  EXPECT_EQ(bare, picture.at<cv::Vec3b>(pixel(-0.3, 0.3))) << "beside it";
  // From behind there is nothing to see.
  PlaneEstimate behind = wall();
  behind.plane = behind.plane.flipped();
  EXPECT_EQ(bare, drawPlanes(gray, {}, *camera(), SE3(), {behind}).at<cv::Vec3b>(pixel(0.2, 0.6)));
}

TEST(PlanePicture, DepthDecidesWhereItIsKnown) {
  const cv::Mat gray(120, 160, CV_8UC1, cv::Scalar(100));
  cv::Mat depth(120, 160, CV_32FC1, cv::Scalar(2.0f));
  depth.rowRange(0, 60).setTo(1.0f);  // an object in front of the upper half
  const cv::Vec3b bare(100, 100, 100);
  const cv::Mat picture = drawPlanes(gray, depth, *camera(), SE3(), {wall()});
  EXPECT_EQ(bare, picture.at<cv::Vec3b>(pixel(0.2, -0.6)));
  EXPECT_NE(bare, picture.at<cv::Vec3b>(pixel(0.2, 0.6)));
}

}  // namespace
}  // namespace vip_slam
