// SPDX-License-Identifier: BSD-3-Clause
#include "pose_in_map.h"

#include <algorithm>

#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

void PoseInMap::setBase(const SE3& T_base_imu) {
  std::lock_guard<std::mutex> lock(mutex_);
  T_base_imu_ = T_base_imu;
}

void PoseInMap::apply(const MapUpdate& update) {
  std::lock_guard<std::mutex> lock(mutex_);
  T_map_odom_ = update.T_map_odom;
  epoch_ = update.epoch;
  placed_ = update.newest_keyframe != 0 && update.placed;
}

void PoseInMap::clear() {
  std::lock_guard<std::mutex> lock(mutex_);
  placed_ = false;
  chain_.clear();
  passes_ = {};
}

std::optional<SE3> PoseInMap::add(const ChainedPose& pose) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (passes_.take(pose.t)) chain_.push_back(pose);
  if (!placed_ || pose.epoch != epoch_) return std::nullopt;
  return T_map_odom_;
}

geometry_msgs::PoseWithCovarianceStamped PoseInMap::message(double t, const SE3& T_map_odom, const SE3& T_odom_I,
                                                            const Matrix15d& covariance,
                                                            const std::string& map_frame) const {
  SE3 T_imu_base;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    T_imu_base = T_base_imu_.inverse();
  }
  const SE3 T_map_I = T_map_odom * T_odom_I;
  geometry_msgs::PoseWithCovarianceStamped msg;
  msg.header.stamp = toStamp(t);
  msg.header.frame_id = map_frame;
  msg.pose.pose = toPoseMsg(T_map_I * T_imu_base);
  Eigen::Matrix<double, 6, 15> J = Eigen::Matrix<double, 6, 15>::Zero();
  J.block<3, 3>(0, 0) = -T_map_I.R() * hat(T_imu_base.t());
  J.block<3, 3>(0, 3) = T_map_odom.R();
  J.block<3, 3>(3, 0) = T_map_I.R();
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(msg.pose.covariance.data()) = J * covariance * J.transpose();
  return msg;
}

Trajectory PoseInMap::trajectory(const std::vector<Anchor>& anchors) const {
  std::vector<ChainedPose> chain;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    chain = chain_;
  }
  Trajectory trajectory = anchorTrajectory(chain, anchors);
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.t < b.t; });
  return trajectory;
}

}  // namespace vip_slam
