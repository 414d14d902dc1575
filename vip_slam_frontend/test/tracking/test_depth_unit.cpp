// SPDX-License-Identifier: BSD-3-Clause
// The unit of depth that changes while recording, and what must not pass for it.
#include <gtest/gtest.h>

#include "test_camera.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_frontend/tracking/depth_unit.h"

namespace vip_slam::frontend {
namespace {

constexpr double kFar = 2.5, kRight = 1.0;  // m, two walls

cv::Mat look(const SE3& T_W_C, double body = 0, double far = kFar, double right = kRight) {
  cv::Mat depth(480, 640, CV_32F);
  cv::RNG random(3);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d ray = T_W_C.R() * Eigen::Vector3d((u - kCx) / kFocal, (v - kCy) / kFocal, 1);
      const double ahead = ray.z() > 0 ? (far - T_W_C.t().z()) / ray.z() : 1e9;
      const double aside = ray.x() > 0 ? (right - T_W_C.t().x()) / ray.x() : 1e9;
      const double z = body > 0 && u < 256 ? body : std::min(ahead, aside);
      depth.at<float>(v, u) = static_cast<float>(z + random.gaussian(0.003 * z));
    }
  }
  return depth;
}

/// A picture on the walls, as it is seen with their depth.
cv::Mat picture(const SE3& T_W_C, double phase = 0, double right = kRight) {
  cv::Mat gray(480, 640, CV_8U);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d ray = T_W_C.R() * Eigen::Vector3d((u - kCx) / kFocal, (v - kCy) / kFocal, 1);
      const double ahead = (kFar - T_W_C.t().z()) / ray.z();
      const double aside = ray.x() > 0 ? (right - T_W_C.t().x()) / ray.x() : 1e9;
      const Eigen::Vector3d p = T_W_C.t() + std::min(ahead, aside) * ray;
      const double along = p.x() + (aside < ahead ? kFar - p.z() : 0.0);
      gray.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(128 + 60 * std::sin(3 * along + phase) * std::cos(4 * p.y()));
    }
  }
  return gray;
}

class DepthUnitTest : public testing::Test {
 protected:
  const SE3 then_{SE3()}, now_{SE3(expSO3(Eigen::Vector3d(0.01, 0.03, -0.02)), {0.03, 0.01, -0.04})};
  DepthUnit unit_{testCamera(), DepthNoise()};
};

TEST_F(DepthUnitTest, AnUnitThatIsSetAnewIsFollowedThereAndBack) {
  const cv::Mat picture_then = picture(then_), picture_now = picture(now_);
  for (const double factor : {2.0, 0.5, 0.9}) {
    DepthUnit unit(testCamera(), DepthNoise());
    unit.remember(look(then_), picture_then, then_, 1.0);
    EXPECT_FALSE(unit.changes(look(now_), picture_now, now_, 1.033));
    EXPECT_DOUBLE_EQ(unit.factor(), 1.0);
    ASSERT_TRUE(unit.changes(factor * look(now_), picture_now, now_, 1.033)) << factor;
    EXPECT_NEAR(unit.factor(), 1 / factor, 0.005 / factor);
    unit.remember(look(now_), picture_now, now_, 1.033);
    EXPECT_FALSE(unit.changes(unit.factor() * factor * look(then_), picture_then, then_, 1.066));
    ASSERT_TRUE(unit.changes(unit.factor() * look(then_), picture_then, then_, 1.066)) << factor;
    EXPECT_NEAR(unit.factor(), 1.0, 0.01);
  }
}

// A motion that nobody predicts: no IMU is wrong by more than twice gravity.
TEST_F(DepthUnitTest, AMotionIsNoUnit) {
  unit_.remember(look(then_), picture(then_), then_, 1.0);
  for (const double step : {-0.3, -0.2, 0.2, 0.3}) {
    // Away from the edge of the two walls both are farther by one share.
    for (const double aside : {0.0, 0.4 * step}) {
      const SE3 there(Eigen::Matrix3d::Identity(), {aside, 0, step});
      EXPECT_FALSE(unit_.changes(look(there), picture(there), then_, 1.2)) << there.t().transpose();
    }
    EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);
  }
}

TEST_F(DepthUnitTest, ABodyThatComesIntoViewIsNoUnit) {
  unit_.remember(look(then_), picture(then_), then_, 1.0);
  EXPECT_FALSE(unit_.changes(look(now_, 0.8), picture(now_), now_, 1.033));
  EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);
}

// Without an image something may as well stand before the wall. What shows it later is compared with the image before.
TEST_F(DepthUnitTest, DepthAloneDecidesNothing) {
  unit_.remember(look(then_), picture(then_), then_, 1.0);
  EXPECT_FALSE(unit_.changes(2 * look(then_), cv::Mat(), then_, 1.033));
  EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);

  unit_.remember(2 * look(then_), cv::Mat(), then_, 1.033);  // passed over: the question is open
  EXPECT_TRUE(unit_.changes(2 * look(then_), picture(then_), then_, 1.066));
}

// The same picture at twice the distance is another unit; where another picture is seen something stands before the
// wall.
TEST_F(DepthUnitTest, OfASingleWallTheImageTellsWhetherItIsTheSame) {
  const cv::Mat wall = look(then_, 0, kFar, 1e6), later = look(now_, 0, kFar, 1e6);
  for (const double factor : {2.0, 0.5}) {
    DepthUnit unit(testCamera(), DepthNoise());
    unit.remember(wall, picture(then_, 0, 1e6), then_, 1.0);
    EXPECT_FALSE(unit.changes(later, picture(now_, 0, 1e6), now_, 1.033));
    EXPECT_FALSE(unit.changes(factor * later, picture(now_, M_PI, 1e6), now_, 1.033)) << "a body";
    EXPECT_FALSE(unit.changes(factor * later, cv::Mat(later.size(), CV_8U, cv::Scalar(128)), now_, 1.033)) << "bare";
    EXPECT_FALSE(unit.changes(1.07 * later, picture(now_, 0, 1e6), now_, 1.033)) << "within the prior of the scale";
    ASSERT_TRUE(unit.changes(factor * later, picture(now_, 0, 1e6), now_, 1.033)) << factor;
    EXPECT_NEAR(unit.factor(), 1 / factor, 0.005 / factor);
  }
}

// What the grid of the brightness leaves over at the edges, as of 848 x 480, must not pass for a contrast.
TEST_F(DepthUnitTest, OfABareWallTheImageTellsNothingAtAnySize) {
  for (const cv::Size& size : {cv::Size(640, 480), cv::Size(848, 480), cv::Size(640, 360), cv::Size(640, 10)}) {
    CameraIntrinsics intrinsics = testCamera()->intrinsics();
    intrinsics.width = size.width, intrinsics.height = size.height;
    intrinsics.cx = 0.5 * (size.width - 1), intrinsics.cy = 0.5 * (size.height - 1);
    const cv::Mat wall(size, CV_32F, cv::Scalar(kFar)), bare(size, CV_8U, cv::Scalar(128));
    DepthUnit unit(makeCamera(intrinsics), DepthNoise());
    unit.remember(wall, bare, then_, 1.0);
    EXPECT_FALSE(unit.changes(0.5 * wall, bare, then_, 1.033)) << size;
  }
}

TEST_F(DepthUnitTest, AfterALongTimeNothingIsCompared) {
  unit_.remember(look(then_), picture(then_), then_, 1.0);
  EXPECT_FALSE(unit_.changes(2 * look(then_), picture(then_), then_, 3.0));
}

}  // namespace
}  // namespace vip_slam::frontend
