// SPDX-License-Identifier: BSD-3-Clause
// Dense alignment of two rendered RGB-D images: large turns without a prediction, exposure, holes and noise of the
// depth, depth of another moment, and what its covariance says.
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_camera.h"
#include "vip_slam_frontend/tracking/dense_alignment.h"

namespace vip_slam::frontend {
namespace {

/// A room: a textured wall 2.5 m ahead, another one 1 m to the right.
struct View {
  cv::Mat gray, depth;
};

View look(const SE3& T_W_C, bool texture) {
  static const cv::Mat pattern = [] {
    // As in natural images the larger structures are the stronger ones.
    cv::Mat sum(1500, 1500, CV_32F, cv::Scalar(0));
    cv::RNG random(11);
    for (const double size : {6.0, 25.0, 100.0}) {
      cv::Mat p(sum.size(), CV_32F);
      random.fill(p, cv::RNG::NORMAL, 0, 1);
      cv::GaussianBlur(p, p, cv::Size(), size);
      cv::normalize(p, p, 0, size, cv::NORM_MINMAX);
      sum += p;
    }
    cv::Mat p;
    cv::normalize(sum, p, 20, 220, cv::NORM_MINMAX, CV_8U);
    return p;
  }();
  View view{cv::Mat(480, 640, CV_8U), cv::Mat(480, 640, CV_32F)};
  const Eigen::Matrix3d R = T_W_C.R();
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d ray = R * Eigen::Vector3d((u - kCx) / kFocal, (v - kCy) / kFocal, 1);
      const double ahead = ray.z() > 0 ? (2.5 - T_W_C.t().z()) / ray.z() : 1e9;
      const double right = ray.x() > 0 ? (1.0 - T_W_C.t().x()) / ray.x() : 1e9;
      const double z = std::min(ahead, right);
      const Eigen::Vector3d p = T_W_C.t() + z * ray;
      const double along = ahead < right ? p.x() : 1.0 + (2.5 - p.z());
      const int x = static_cast<int>(700 + 200 * along), y = static_cast<int>(700 + 200 * p.y());
      view.gray.at<std::uint8_t>(v, u) =
          texture ? pattern.at<std::uint8_t>(std::clamp(y, 0, 1499), std::clamp(x, 0, 1499)) : 128;
      view.depth.at<float>(v, u) = static_cast<float>(z);
    }
  }
  return view;
}

double turnError(const std::optional<AlignedMotion>& found, const SE3& truth) {
  return found ? logSO3((found->T_current_previous.inverse() * truth).R()).norm() : 1e9;
}

double displacementError(const std::optional<AlignedMotion>& found, const SE3& truth) {
  return found ? (found->T_current_previous.t() - truth.t()).norm() : 1e9;
}

TEST(DenseAlignment, FindsATurnOfThreeRadiansPerSecondBetweenImages) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const SE3 T_W_a(expSO3(Eigen::Vector3d(0, 0.2, 0)), Eigen::Vector3d::Zero());
  const View a = look(T_W_a, true);
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(0, 0.1, 0), Eigen::Vector3d(0, -0.1, 0),
                                      Eigen::Vector3d(0.07, 0.05, 0), Eigen::Vector3d(0.02, 0, 0.1)}) {
    const SE3 T_a_b(expSO3(turn), Eigen::Vector3d(0.03, -0.01, 0.02));
    const View b = look(T_W_a * T_a_b, true);
    const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, b.gray, b.depth, 1.0, SE3());
    EXPECT_LT(turnError(found, T_a_b.inverse()), 0.006) << turn.transpose();
    EXPECT_LT(displacementError(found, T_a_b.inverse()), 0.015) << turn.transpose();
  }
}

TEST(DenseAlignment, ExposureThatChangesIsNoMotion) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const View a = look(SE3(), true);
  cv::Mat brighter;
  a.gray.convertTo(brighter, CV_8U, 1.0, 25.0);
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, brighter, a.depth, 1.0, SE3());
  EXPECT_LT(turnError(found, SE3()), 1e-3);
  EXPECT_LT(displacementError(found, SE3()), 2e-3);
}

TEST(DenseAlignment, WithoutTextureDepthTellsWhatItHolds) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const SE3 T_W_a(expSO3(Eigen::Vector3d(0, 0.4, 0)), Eigen::Vector3d::Zero());
  const SE3 T_a_b(expSO3(Eigen::Vector3d(0, 0.03, 0)), Eigen::Vector3d(0, 0, 0.03));
  const View a = look(T_W_a, false), b = look(T_W_a * T_a_b, false);
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, b.gray, b.depth, 1.0, SE3());
  EXPECT_LT(turnError(found, T_a_b.inverse()), 0.01);
}

TEST(DenseAlignment, WithoutDepthTheTurnRemains) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const SE3 T_a_b(expSO3(Eigen::Vector3d(0.02, 0.08, 0)), Eigen::Vector3d::Zero());
  const View a = look(SE3(), true), b = look(T_a_b, true);
  EXPECT_LT(turnError(alignment.motion(a.gray, cv::Mat(), b.gray, cv::Mat(), 1.0, SE3()), T_a_b.inverse()), 0.005);
}

TEST(DenseAlignment, ANearSurfaceWithoutDepthTurnsNoDisplacementIntoATurn) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const SE3 T_a_b(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.03, 0, 0));
  View a = look(SE3(), true);
  const View b = look(T_a_b, true);
  a.depth.rowRange(0, 280).setTo(0);  // more than half of the wall at 2.5 m
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, b.gray, b.depth, 1.0, SE3());
  EXPECT_LT(turnError(found, T_a_b.inverse()), 0.003);  // the displacement at infinity would be a turn of 0.012
  EXPECT_LT(displacementError(found, T_a_b.inverse()), 0.008);
}

TEST(DenseAlignment, NoiseOfTheDepthDoesNotShortenDisplacements) {
  DepthNoise noise;
  const DenseAlignment alignment(testCamera(kFocal), noise);
  const SE3 T_W_a(expSO3(Eigen::Vector3d(0, 0.4, 0)), Eigen::Vector3d::Zero());
  const SE3 T_a_b(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.03, 0, 0.02));
  View a = look(T_W_a, false), b = look(T_W_a * T_a_b, false);
  cv::RNG random(5);
  for (View* view : {&a, &b}) {
    for (auto z = view->depth.begin<float>(); z != view->depth.end<float>(); ++z)
      *z += static_cast<float>(random.gaussian(noise.sigma(*z)));
  }
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, b.gray, b.depth, 1.0, SE3());
  // Two walls at a right angle hold the horizontal directions, and nothing the vertical one.
  ASSERT_TRUE(found);
  const Eigen::Vector3d error = T_W_a.R() * (found->T_current_previous.t() - T_a_b.inverse().t());
  EXPECT_LT(std::hypot(error.x(), error.z()), 0.004);
  EXPECT_LT(std::abs(error.y()), 3 * std::sqrt(found->covariance(4, 4)));
}

TEST(DenseAlignment, DepthMayBeOfAnotherMoment) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const SE3 T_a_b(expSO3(Eigen::Vector3d(0, 0.05, 0)), Eigen::Vector3d(0.02, 0, 0.03));
  const Vector6d further = 1.25 * T_a_b.boxminus(SE3());
  const View a = look(SE3(), true), b = look(T_a_b, true), later = look(SE3().boxplus(further), true);
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, b.gray, later.depth, 1.25, SE3());
  EXPECT_LT(turnError(found, T_a_b.inverse()), 0.004);
  EXPECT_LT(displacementError(found, T_a_b.inverse()), 0.006);
  // Taken for one of the same moment it pulls the motion on.
  const std::optional<AlignedMotion> wrong = alignment.motion(a.gray, a.depth, b.gray, later.depth, 1.0, SE3());
  EXPECT_GT(displacementError(wrong, T_a_b.inverse()), 1.5 * displacementError(found, T_a_b.inverse()));
}

TEST(DenseAlignment, TheCovarianceKnowsWhatNothingHolds) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  // A single bare wall: nothing holds the displacement along it, its distance and tilt are held.
  const SE3 T_W_a(expSO3(Eigen::Vector3d(0, -0.3, 0)), Eigen::Vector3d::Zero());
  const View a = look(T_W_a, false);
  const std::optional<AlignedMotion> found = alignment.motion(a.gray, a.depth, a.gray, a.depth, 1.0, SE3());
  ASSERT_TRUE(found);
  const Eigen::Vector3d normal = T_W_a.R().transpose() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d along = T_W_a.R().transpose() * Eigen::Vector3d::UnitX();
  const Eigen::Matrix3d P = found->covariance.bottomRightCorner<3, 3>();
  EXPECT_LT(std::sqrt(normal.dot(P * normal)), 0.01);
  EXPECT_GT(std::sqrt(along.dot(P * along)), 0.03);
}

TEST(DenseAlignment, NothingFromNothing) {
  const DenseAlignment alignment(testCamera(kFocal), DepthNoise());
  const View a = look(SE3(), true);
  EXPECT_FALSE(alignment.motion(cv::Mat(), cv::Mat(), a.gray, a.depth, 1.0, SE3()));
}

}  // namespace
}  // namespace vip_slam::frontend
