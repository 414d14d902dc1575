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

class DepthUnitTest : public testing::Test {
 protected:
  const SE3 then_{SE3()}, now_{SE3(expSO3(Eigen::Vector3d(0.01, 0.03, -0.02)), {0.03, 0.01, -0.04})};
  DepthUnit unit_{testCamera(), DepthNoise()};
};

TEST_F(DepthUnitTest, AnUnitThatIsSetAnewIsFollowedThereAndBack) {
  for (const double factor : {2.0, 0.5, 0.9}) {
    DepthUnit unit(testCamera(), DepthNoise());
    unit.remember(look(then_), cv::Mat(), then_, 1.0);
    EXPECT_FALSE(unit.changes(look(now_), cv::Mat(), now_, 1.033));
    EXPECT_DOUBLE_EQ(unit.factor(), 1.0);
    ASSERT_TRUE(unit.changes(factor * look(now_), cv::Mat(), now_, 1.033)) << factor;
    EXPECT_NEAR(unit.factor(), 1 / factor, 0.005 / factor);
    unit.remember(look(now_), cv::Mat(), now_, 1.033);
    EXPECT_FALSE(unit.changes(unit.factor() * factor * look(then_), cv::Mat(), then_, 1.066));
    ASSERT_TRUE(unit.changes(unit.factor() * look(then_), cv::Mat(), then_, 1.066)) << factor;
    EXPECT_NEAR(unit.factor(), 1.0, 0.01);
  }
}

// A motion that nobody predicts brings the near wall nearer by a larger share than the far one.
TEST_F(DepthUnitTest, AMotionIsNoUnit) {
  unit_.remember(look(then_), cv::Mat(), then_, 1.0);
  for (const double step : {-0.3, -0.2, 0.2, 0.3}) {
    EXPECT_FALSE(unit_.changes(look(SE3(Eigen::Matrix3d::Identity(), {0, 0, step})), cv::Mat(), then_, 1.033)) << step;
    // Away from the edge of the two walls both are farther by one share.
    EXPECT_FALSE(unit_.changes(look(SE3(Eigen::Matrix3d::Identity(), {0.4 * step, 0, step})), cv::Mat(), then_, 1.2))
        << step;
    EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);
  }
}

TEST_F(DepthUnitTest, ABodyThatComesIntoViewIsNoUnit) {
  unit_.remember(look(then_), cv::Mat(), then_, 1.0);
  EXPECT_FALSE(unit_.changes(look(now_, 0.8), cv::Mat(), now_, 1.033));
  EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);
}

// A single wall may as well have come nearer. What shows it later is compared with the image before.
TEST_F(DepthUnitTest, ASingleWallDecidesNothing) {
  unit_.remember(look(then_, 0, kFar, 1e6), cv::Mat(), then_, 1.0);
  EXPECT_FALSE(unit_.changes(2 * look(then_, 0, kFar, 1e6), cv::Mat(), then_, 1.033));
  EXPECT_DOUBLE_EQ(unit_.factor(), 1.0);

  unit_.remember(look(then_), cv::Mat(), then_, 1.066);  // passed over: the question is open
  EXPECT_FALSE(unit_.changes(cv::Mat(), cv::Mat(), then_, 1.1));
}

/// A picture on the far wall, as it is seen with its depth.
cv::Mat picture(const SE3& T_W_C, double phase) {
  cv::Mat gray(480, 640, CV_8U);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d ray = T_W_C.R() * Eigen::Vector3d((u - kCx) / kFocal, (v - kCy) / kFocal, 1);
      const Eigen::Vector3d p = T_W_C.t() + (kFar - T_W_C.t().z()) / ray.z() * ray;
      gray.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(128 + 60 * std::sin(3 * p.x() + phase) * std::cos(4 * p.y()));
    }
  }
  return gray;
}

// The same picture at twice the distance is another unit; where another picture is seen something stands before the
// wall.
TEST_F(DepthUnitTest, OfASingleWallTheImageTellsWhetherItIsTheSame) {
  const cv::Mat wall = look(then_, 0, kFar, 1e6), later = look(now_, 0, kFar, 1e6);
  for (const double factor : {2.0, 0.5}) {
    DepthUnit unit(testCamera(), DepthNoise());
    unit.remember(wall, picture(then_, 0), then_, 1.0);
    EXPECT_FALSE(unit.changes(later, picture(now_, 0), now_, 1.033));
    EXPECT_FALSE(unit.changes(factor * later, picture(now_, M_PI), now_, 1.033)) << "a body";
    EXPECT_FALSE(unit.changes(factor * later, cv::Mat(later.size(), CV_8U, cv::Scalar(128)), now_, 1.033)) << "bare";
    EXPECT_FALSE(unit.changes(1.2 * later, picture(now_, 0), now_, 1.033)) << "a motion";
    ASSERT_TRUE(unit.changes(factor * later, picture(now_, 0), now_, 1.033)) << factor;
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
  unit_.remember(look(then_), cv::Mat(), then_, 1.0);
  EXPECT_FALSE(unit_.changes(2 * look(then_), cv::Mat(), then_, 3.0));
}

}  // namespace
}  // namespace vip_slam::frontend
