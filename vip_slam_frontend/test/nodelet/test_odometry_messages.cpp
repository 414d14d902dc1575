// SPDX-License-Identifier: BSD-3-Clause
// The odometry message: base_link's pose and twist, and covariances checked by perturbing the state.
#include <gtest/gtest.h>

#include "odometry_messages.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {
namespace {

class OdometryMessage : public ::testing::Test {
 protected:
  void SetUp() override {
    state_.T_W_I = SE3(expQuaternion({0.3, -0.2, 0.9}), {1, 2, 3});
    state_.v_W = {0.5, -0.3, 0.1};
    state_.bias_gyro = {0.01, -0.02, 0.03};
    frames_.T_base_imu = SE3(expQuaternion({0.1, 0.7, -0.4}), {0.2, -0.1, 0.3});
  }
  nav_msgs::Odometry message(const NavState& state) const {
    return toOdometry(ros::Time(1), state, Matrix15d::Zero(), gyro_, 0, frames_);
  }
  /// (position, rotation in odom axes) of b relative to a, and the twist's difference.
  Eigen::Matrix<double, 12, 1> difference(const nav_msgs::Odometry& a, const nav_msgs::Odometry& b) const {
    Eigen::Matrix<double, 12, 1> d;
    const SE3 T_a = fromMsg(a.pose.pose), T_b = fromMsg(b.pose.pose);
    d.segment<3>(0) = T_b.t() - T_a.t();
    d.segment<3>(3) = logSO3(T_b.rotation() * T_a.rotation().conjugate());
    d.segment<3>(6) = fromMsg(b.twist.twist.linear) - fromMsg(a.twist.twist.linear);
    d.segment<3>(9) = fromMsg(b.twist.twist.angular) - fromMsg(a.twist.twist.angular);
    return d;
  }
  NavState perturbed(int i, double h) const {
    NavState s = state_;
    Eigen::Matrix<double, 15, 1> d = Eigen::Matrix<double, 15, 1>::Zero();
    d[i] = h;
    s.T_W_I = s.T_W_I.boxplus(d.head<6>());
    s.v_W += d.segment<3>(6);
    s.bias_gyro += d.segment<3>(9);
    s.bias_accel += d.segment<3>(12);
    return s;
  }
  NavState state_;
  Eigen::Vector3d gyro_{0.4, 0.2, -0.6};
  OdometryFrames frames_;
};

TEST_F(OdometryMessage, TheStampIsExact) {
  const ros::Time stamp(1700000000, 123456789);  // not representable as a double
  const auto msg = toOdometry(stamp, state_, Matrix15d::Zero(), gyro_, 0, frames_);
  EXPECT_EQ(msg.header.stamp, stamp);
  EXPECT_EQ(toTransform(msg).header.stamp, stamp);
}

TEST_F(OdometryMessage, PoseIsThatOfTheBase) {
  const SE3 T = fromMsg(message(state_).pose.pose);
  EXPECT_LT(T.boxminus(state_.T_W_I * frames_.T_base_imu.inverse()).norm(), 1e-12);
}

TEST_F(OdometryMessage, TwistIsThePosesDerivative) {
  const double h = 1e-6;
  NavState later = state_;
  const Eigen::Vector3d rate = gyro_ - state_.bias_gyro;
  later.T_W_I = SE3(state_.T_W_I.rotation() * expQuaternion(rate * h), state_.T_W_I.t() + state_.v_W * h);
  const SE3 a = fromMsg(message(state_).pose.pose), b = fromMsg(message(later).pose.pose);
  const auto msg = message(state_);
  EXPECT_LT((fromMsg(msg.twist.twist.linear) - a.rotation().conjugate() * (b.t() - a.t()) / h).norm(), 1e-5);
  EXPECT_LT((fromMsg(msg.twist.twist.angular) - logSO3(a.rotation().conjugate() * b.rotation()) / h).norm(), 1e-5);
}

TEST_F(OdometryMessage, CovarianceIsPropagated) {
  // Numeric Jacobian of the message with respect to the state, against the covariance the message carries.
  const double h = 1e-6;
  Eigen::Matrix<double, 12, 15> J;
  for (int i = 0; i < 15; ++i) {
    J.col(i) = difference(message(perturbed(i, -h)), message(perturbed(i, h))) / (2 * h);
  }
  Matrix15d A = Matrix15d::Random();
  const Matrix15d P = A * A.transpose();
  const auto msg = toOdometry(ros::Time(1), state_, P, gyro_, 0, frames_);
  const Eigen::Matrix<double, 12, 12> expected = J * P * J.transpose();
  using Row6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const Row6 pose = Eigen::Map<const Row6>(msg.pose.covariance.data());
  const Row6 twist = Eigen::Map<const Row6>(msg.twist.covariance.data());
  EXPECT_LT((pose - expected.topLeftCorner<6, 6>()).norm(), 1e-6 * expected.norm());
  EXPECT_LT((twist - expected.bottomRightCorner<6, 6>()).norm(), 1e-6 * expected.norm());
}

}  // namespace
}  // namespace vip_slam
