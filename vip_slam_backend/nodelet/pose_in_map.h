// SPDX-License-Identifier: BSD-3-Clause
// Pose of the body in `map` at each image: T_map_odom of the back end times the odometry. Thread-safe: frames arrive at
// image rate while the estimator is busy.
#pragma once

#include <mutex>
#include <optional>
#include <vector>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/trajectory/anchored_trajectory.h"
#include "vip_slam_core/trajectory/time_passes.h"
#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

class PoseInMap {
 public:
  void setBase(const SE3& T_base_imu);
  void apply(const MapUpdate& update);
  void clear();

  /// Stores the image's pose for trajectory(). Returns T_map_odom; empty while the back end has not placed this epoch
  /// of the odometry in the map.
  std::optional<SE3> add(const ChainedPose& pose);
  /// T_map_base with covariance (x, y, z, rotation about the fixed axes of map) of the odometry seen from map.
  geometry_msgs::PoseWithCovarianceStamped message(double t, const SE3& T_map_odom, const SE3& T_odom_I,
                                                   const Matrix15d& covariance, const std::string& map_frame) const;
  /// Every image so far, re-anchored on `anchors`, in order of the stamps.
  Trajectory trajectory(const std::vector<Anchor>& anchors) const;

 private:
  mutable std::mutex mutex_;
  SE3 T_base_imu_, T_map_odom_;
  std::uint32_t epoch_ = 0;
  bool placed_ = false;
  std::vector<ChainedPose> chain_;
  TimePasses passes_;
};

}  // namespace vip_slam
