// SPDX-License-Identifier: BSD-3-Clause
// The odometry's motion as a factor: weighted by its reported covariance, left out when it reports none.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../../src/optimisation/odometry_factors.h"
#include "vip_slam_backend/factors/relative_pose.h"

using namespace vip_slam;

namespace {

MapKeyframe keyframeWithMotion() {
  MapKeyframe kf;
  kf.motion.T_a_b = SE3(expQuaternion(Eigen::Vector3d(0.1, -0.2, 0.3)), Eigen::Vector3d(0.4, 0.1, -0.2));
  Matrix6d L = Matrix6d::Identity();
  L(3, 0) = 0.5, L(4, 2) = -0.7, L(5, 1) = 0.3;
  const Vector6d sigma = (Vector6d() << 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3).finished();
  kf.motion.covariance = L * sigma.cwiseAbs2().asDiagonal() * L.transpose();
  return kf;
}

}  // namespace

TEST(OdometryFactors, InformationIsThatOfTheCovariance) {
  const MapKeyframe kf = keyframeWithMotion();
  MeasurementOptions options;
  BaRelativePose factor;
  ASSERT_TRUE(odometryFactor(kf, 4, 7, options, &factor));
  EXPECT_EQ(factor.i, 4);
  EXPECT_EQ(factor.j, 7);
  const Matrix6d covariance = (factor.sqrt_information.transpose() * factor.sqrt_information).inverse();
  // The lower bound on the odometry's noise adds at most one per cent.
  EXPECT_LT((covariance - kf.motion.covariance).norm(), 0.01 * covariance.norm());
  EXPECT_TRUE(factor.sqrt_information.isUpperTriangular());
  const SE3 T_W_i(expQuaternion(Eigen::Vector3d(1, 2, -1)), Eigen::Vector3d(5, -3, 1));
  EXPECT_LT(relativePoseResidual(T_W_i, T_W_i * kf.motion.T_a_b, factor.T_i_j).norm(), 1e-12);
}

TEST(OdometryFactors, NoneWithoutMotionOrWhenSwitchedOff) {
  MapKeyframe kf = keyframeWithMotion();
  MeasurementOptions options;
  BaRelativePose factor;
  options.use_odometry = false;
  EXPECT_FALSE(odometryFactor(kf, 0, 1, options, &factor));
  options.use_odometry = true;
  EXPECT_TRUE(odometryFactor(kf, 0, 1, options, &factor));
  kf.motion = RelativeMotion();
  EXPECT_FALSE(odometryFactor(kf, 0, 1, options, &factor));
}

TEST(OdometryFactors, AMotionWithoutErrorIsStillBounded) {
  MapKeyframe kf = keyframeWithMotion();
  kf.motion.covariance = 1e-30 * Matrix6d::Identity();
  BaRelativePose factor;
  ASSERT_TRUE(odometryFactor(kf, 0, 1, MeasurementOptions(), &factor));
  EXPECT_LT(factor.sqrt_information.norm(), 1e5);
}
