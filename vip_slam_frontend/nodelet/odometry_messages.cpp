// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_messages.h"

#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

nav_msgs::Odometry toOdometry(const ros::Time& stamp, const NavState& state, const Matrix15d& covariance,
                              const Eigen::Vector3d& gyro, double gyro_sigma, const OdometryFrames& frames) {
  const SE3 T_imu_base = frames.T_base_imu.inverse();
  const SE3 T_odom_base = state.T_W_I * T_imu_base;
  const Eigen::Matrix3d R_odom_imu = state.T_W_I.R(), R_base_imu = frames.T_base_imu.R();
  const Eigen::Vector3d arm = T_imu_base.t();  // base_link seen from the IMU, IMU frame
  const Eigen::Vector3d rate = gyro - state.bias_gyro;

  nav_msgs::Odometry msg;
  msg.header.stamp = stamp;
  msg.header.frame_id = frames.odom;
  msg.child_frame_id = frames.base;
  msg.pose.pose = toPoseMsg(T_odom_base);
  // p_base = p + R arm, so dp_base = dp - R [arm]x dtheta; a rotation dtheta in the IMU frame is R dtheta in odom.
  using Jacobian = Eigen::Matrix<double, 6, 15>;
  Jacobian J = Jacobian::Zero();
  J.block<3, 3>(0, 0) = -R_odom_imu * hat(arm);
  J.block<3, 3>(0, 3).setIdentity();
  J.block<3, 3>(3, 0) = R_odom_imu;
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(msg.pose.covariance.data()) = J * covariance * J.transpose();

  const Eigen::Vector3d v_imu = R_odom_imu.transpose() * state.v_W;  // of the IMU, in its own axes
  msg.twist.twist.linear = toVectorMsg(R_base_imu * (v_imu + rate.cross(arm)));
  msg.twist.twist.angular = toVectorMsg(R_base_imu * rate);
  // v_base = R_bi (R^T v + (w - b_g) x arm): d/dtheta = R_bi [R^T v]x, d/dv = R_bi R^T, d/db_g = R_bi [arm]x.
  J.setZero();
  J.block<3, 3>(0, 0) = R_base_imu * hat(v_imu);
  J.block<3, 3>(0, 6) = R_base_imu * R_odom_imu.transpose();
  J.block<3, 3>(0, 9) = R_base_imu * hat(arm);
  J.block<3, 3>(3, 9) = -R_base_imu;
  Matrix6d twist = J * covariance * J.transpose();
  twist.bottomRightCorner<3, 3>().diagonal().array() += gyro_sigma * gyro_sigma;
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(msg.twist.covariance.data()) = twist;
  return msg;
}

geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry) {
  geometry_msgs::TransformStamped transform;
  transform.header = odometry.header;
  transform.child_frame_id = odometry.child_frame_id;
  transform.transform.translation.x = odometry.pose.pose.position.x;
  transform.transform.translation.y = odometry.pose.pose.position.y;
  transform.transform.translation.z = odometry.pose.pose.position.z;
  transform.transform.rotation = odometry.pose.pose.orientation;
  return transform;
}

}  // namespace vip_slam
