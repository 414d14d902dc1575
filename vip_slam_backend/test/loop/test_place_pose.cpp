// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "vip_slam_backend/loop/place_pose.h"

namespace vip_slam {
namespace {

class PlacePoseTest : public ::testing::Test {
 protected:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  double normal(double s) { return std::normal_distribution<double>(0, s)(random_); }

  // A camera with some tilt at a random place; `inlier_ratio` of the matches are true.
  void make(int n, double inlier_ratio, bool depth) {
    T_W_C_ = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-3, 3), Eigen::Vector3d::UnitZ())) *
                     Eigen::Quaterniond(Eigen::AngleAxisd(-M_PI / 2 + uniform(-0.3, 0.3), Eigen::Vector3d::UnitX())) *
                     Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-0.2, 0.2), Eigen::Vector3d::UnitZ())),
                 Eigen::Vector3d(uniform(-20, 20), uniform(-20, 20), uniform(0, 2)));
    // The attitude the odometry reports: right tilt, any yaw.
    R_G_C_ = Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-3, 3), Eigen::Vector3d::UnitZ())) * T_W_C_.rotation();
    matches_.clear();
    truth_.clear();
    for (int k = 0; k < n; ++k) {
      const Eigen::Vector2d xy(uniform(-0.6, 0.6), uniform(-0.45, 0.45));
      const double z = uniform(1, 6);
      PlaceMatch m;
      m.p_W = T_W_C_ * Eigen::Vector3d(xy.x() * z, xy.y() * z, z);
      const bool inlier = k < inlier_ratio * n;
      if (!inlier) m.p_W = T_W_C_.t() + Eigen::Vector3d(uniform(-6, 6), uniform(-6, 6), uniform(-2, 2));
      m.xy = xy + Eigen::Vector2d(normal(0.7), normal(0.7)) / 500.0;
      m.depth_sigma = 0.005 * z;
      if (depth) m.depth = z + normal(m.depth_sigma);
      matches_.push_back(m);
      truth_.push_back(inlier);
    }
  }
  void expectFound(double position, double angle) {
    PlacePoseOptions options;
    const PlacePose coarse = ransacPlacePose(matches_, singleCamera(), R_G_C_, options);
    ASSERT_TRUE(coarse.found);
    const PlacePose fine = refinePlacePose(matches_, singleCamera(), coarse.T_W_B, R_G_C_, options);
    ASSERT_TRUE(fine.found);
    const Vector6d error = fine.T_W_B.boxminus(T_W_C_);
    EXPECT_LT(error.tail<3>().norm(), position);
    EXPECT_LT(error.head<3>().norm(), angle);
    int right = 0, wrong = 0;
    for (const std::uint32_t k : fine.inliers) (truth_[k] ? right : wrong) += 1;
    const int all = static_cast<int>(std::count(truth_.begin(), truth_.end(), true));
    EXPECT_GE(right, 0.9 * all);
    EXPECT_LE(wrong, 2);
    // The information matrix predicts the error: 6 degrees of freedom, 99.99 % below 28.
    EXPECT_LT(error.dot(fine.information * error), 40.0);
  }
  std::mt19937_64 random_{5};
  SE3 T_W_C_;
  Eigen::Quaterniond R_G_C_;
  std::vector<PlaceMatch> matches_;
  std::vector<bool> truth_;
};

TEST_F(PlacePoseTest, WithDepthAndManyOutliers) {
  for (int trial = 0; trial < 50; ++trial) {
    make(80, 0.3, true);
    expectFound(0.02, 0.006);
  }
}

TEST_F(PlacePoseTest, WithoutDepthFromGravityAndTwoRays) {
  for (int trial = 0; trial < 50; ++trial) {
    make(80, 0.6, false);
    expectFound(0.04, 0.01);
  }
}

TEST_F(PlacePoseTest, RefinementCorrectsTheTiltThatRansacHeld) {
  make(100, 1.0, true);
  R_G_C_ = Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX())) * R_G_C_;
  expectFound(0.02, 0.005);
}

TEST_F(PlacePoseTest, NothingButOutliersGivesFewInliers) {
  int worst = 0;
  for (int trial = 0; trial < 50; ++trial) {
    make(80, 0.0, true);
    const PlacePose pose = ransacPlacePose(matches_, singleCamera(), R_G_C_, {});
    worst = std::max(worst, static_cast<int>(pose.inliers.size()));
  }
  EXPECT_LT(worst, 8);
}

// Three cameras on one body, each with too few matches alone.
TEST_F(PlacePoseTest, RigOfCameras) {
  for (int trial = 0; trial < 20; ++trial) {
    make(1, 1.0, true);
    const SE3 T_W_B = T_W_C_;
    const Eigen::Quaterniond R_G_B = R_G_C_;
    CameraRig rig;
    std::vector<PlaceMatch> matches;
    for (std::uint32_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d axis(normal(1), normal(1), normal(1));
      rig.emplace_back(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, axis.normalized())),
                       Eigen::Vector3d(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5)));
      for (int k = 0; k < 12; ++k) {
        PlaceMatch m;
        const double z = uniform(1, 6);
        m.camera = c;
        m.xy = Eigen::Vector2d(uniform(-0.6, 0.6), uniform(-0.45, 0.45));
        m.depth = z;
        m.depth_sigma = 0.005 * z;
        m.p_W = T_W_B * (rig[c] * Eigen::Vector3d(m.xy.x() * z, m.xy.y() * z, z));
        if (k % 3 == 2) m.p_W += Eigen::Vector3d(uniform(1, 3), uniform(-3, 3), uniform(-1, 1));  // a wrong match
        matches.push_back(m);
      }
    }
    PlacePoseOptions options;
    options.iterations = 1000;
    const PlacePose coarse = ransacPlacePose(matches, rig, R_G_B, options);
    ASSERT_TRUE(coarse.found);
    EXPECT_GE(coarse.inliers.size(), 20u);
    // Without noise the pose is exact, and it stays exact with a gravity prior.
    for (const double tilt_sigma : {0.0, 0.003}) {
      options.tilt_sigma = tilt_sigma;
      const PlacePose fine = refinePlacePose(matches, rig, coarse.T_W_B, R_G_B, options);
      ASSERT_TRUE(fine.found);
      EXPECT_LT(fine.T_W_B.boxminus(T_W_B).norm(), 1e-5);
    }
  }
}

TEST_F(PlacePoseTest, GravityHoldsTheTiltThatFewPointsLeaveFree) {
  make(4, 1.0, true);
  PlacePoseOptions options;
  const PlacePose free = refinePlacePose(matches_, singleCamera(), T_W_C_, R_G_C_, options);
  options.tilt_sigma = 1e-4;
  const PlacePose held = refinePlacePose(matches_, singleCamera(), T_W_C_, R_G_C_, options);
  const auto tilt = [&](const PlacePose& pose) {
    return (pose.T_W_B.rotation().conjugate() * Eigen::Vector3d::UnitZ() -
            R_G_C_.conjugate() * Eigen::Vector3d::UnitZ())
        .norm();
  };
  EXPECT_LT(tilt(held), 1e-4);
  EXPECT_GT(tilt(free), tilt(held));
}

TEST_F(PlacePoseTest, ABareWallHoldsTheYawThatFewCornersLeaveUncertain) {
  // Five corners in the middle of a wall four metres ahead, and the wall in the depth image.
  const SE3 T_W_C(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(1, 2, 1.5));
  const Plane wall(Eigen::Vector3d(-1, 0, 0), 5.0);
  PlacePoseOptions options;
  options.tilt_sigma = 0.003;
  double free = 0, held = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<PlaceMatch> matches;
    for (int k = 0; k < 5; ++k) {
      PlaceMatch m;
      m.xy = Eigen::Vector2d(uniform(-0.1, 0.1), uniform(-0.1, 0.1));
      m.p_W = T_W_C * Eigen::Vector3d(4 * m.xy.x(), 4 * m.xy.y(), 4);
      m.xy += Eigen::Vector2d(normal(0.7), normal(0.7)) / 500.0;
      m.depth_sigma = 0.02;
      m.depth = 4 + normal(m.depth_sigma);
      matches.push_back(m);
    }
    std::vector<PlaceSurface> surfaces;
    for (int k = 0; k < 60; ++k) {
      const Eigen::Vector3d p(4 * uniform(-0.6, 0.6), 4 * uniform(-0.45, 0.45), 4 + normal(0.01));
      surfaces.push_back({0, p, wall, 0.03});
    }
    const SE3 start(T_W_C.rotation() * expQuaternion({0, 0.01, 0}), T_W_C.t() + Eigen::Vector3d(0.02, 0, 0));
    const PlacePose without = refinePlacePose(matches, singleCamera(), start, T_W_C.rotation(), options);
    const PlacePose with = refinePlacePose(matches, singleCamera(), start, T_W_C.rotation(), options, surfaces);
    ASSERT_TRUE(without.found && with.found);
    free += without.T_W_B.boxminus(T_W_C).head<3>().squaredNorm();
    held += with.T_W_B.boxminus(T_W_C).head<3>().squaredNorm();
    EXPECT_LT(std::abs(with.T_W_B.t().x() - 1.0), 0.01);
  }
  EXPECT_LT(std::sqrt(held / 40), 0.004);
  EXPECT_LT(held, 0.25 * free);
}

TEST_F(PlacePoseTest, DepthsThatShareTheirErrorAreNotWorthTheirNumber) {
  PlacePoseOptions options;
  const double shared = 1.0;  // in sigmas of a reading: one error for the whole image
  double nees = 0, as_independent = 0;
  const int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    make(60, 1.0, true);
    const double common = normal(shared);
    for (PlaceMatch& m : matches_) {
      // Corners in the middle of a wall, where one error is shared by all.
      const Eigen::Vector2d xy(uniform(-0.02, 0.02), uniform(-0.02, 0.02));
      m.xy = xy + Eigen::Vector2d(normal(1), normal(1)) / options.focal;
      const double z = uniform(3.8, 4.2);
      m.p_W = T_W_C_ * Eigen::Vector3d(xy.x() * z, xy.y() * z, z);
      m.depth_sigma = 0.02;
      m.depth = z + normal(m.depth_sigma) + common * m.depth_sigma;
    }
    const auto along = [&](const PlacePose& pose) {
      const Matrix6d covariance = pose.information.inverse();
      const Eigen::Vector3d axis = T_W_C_.R().col(2);
      return std::pow(axis.dot(pose.T_W_B.t() - T_W_C_.t()), 2) / axis.dot(covariance.bottomRightCorner<3, 3>() * axis);
    };
    options.tilt_sigma = 0.003;
    options.depth_shared = 0;
    const PlacePose independent = refinePlacePose(matches_, singleCamera(), T_W_C_, R_G_C_, options);
    options.depth_shared = shared;
    const PlacePose pose = refinePlacePose(matches_, singleCamera(), T_W_C_, R_G_C_, options);
    ASSERT_TRUE(independent.found && pose.found);
    EXPECT_TRUE(independent.T_W_B.t().isApprox(pose.T_W_B.t()));  // it is said what the estimate is worth
    nees += along(pose) / trials;
    as_independent += along(independent) / trials;
  }
  std::printf("error along the view over its variance: %.2f; depths as independent: %.2f\n", nees, as_independent);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.5);
  EXPECT_GT(as_independent, 10.0);
}

TEST_F(PlacePoseTest, SameSeedSameAnswer) {
  make(80, 0.4, true);
  const PlacePose a = ransacPlacePose(matches_, singleCamera(), R_G_C_, {}),
                  b = ransacPlacePose(matches_, singleCamera(), R_G_C_, {});
  EXPECT_EQ(a.inliers, b.inliers);
  EXPECT_EQ(a.T_W_B.matrix(), b.T_W_B.matrix());
}

TEST_F(PlacePoseTest, DegenerateInput) {
  EXPECT_FALSE(ransacPlacePose({}, singleCamera(), Eigen::Quaterniond::Identity(), {}).found);
  make(10, 1.0, true);
  for (PlaceMatch& m : matches_) m = matches_[0];
  EXPECT_FALSE(ransacPlacePose(matches_, singleCamera(), R_G_C_, {}).found);
  EXPECT_FALSE(refinePlacePose(matches_, singleCamera(), T_W_C_, R_G_C_, {}).found);
}

}  // namespace
}  // namespace vip_slam
