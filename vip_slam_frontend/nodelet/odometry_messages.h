// SPDX-License-Identifier: BSD-3-Clause
// The front end's state as nav_msgs/Odometry: the pose of base_link in odom, its twist in base_link, both with
// covariance (REP-105).
#pragma once

#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

struct OdometryFrames {
  std::string odom = "odom", base = "base_link";
  SE3 T_base_imu;
};

/// `gyro`: measured rate in the IMU frame, rad/s (the bias of the state is taken off); `gyro_sigma`: its noise, rad/s.
/// Covariances follow ROS: pose (x, y, z, rotation about the fixed axes of odom), twist (linear, angular) in base_link.
nav_msgs::Odometry toOdometry(const ros::Time& stamp, const NavState& state, const Matrix15d& covariance,
                              const Eigen::Vector3d& gyro, double gyro_sigma, const OdometryFrames& frames);

geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry);

}  // namespace vip_slam
