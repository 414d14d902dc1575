// SPDX-License-Identifier: BSD-3-Clause
// The map for rviz: keyframes, trajectory, loop edges, landmarks. It is built from the map updates, so that nothing has
// to be copied from the estimator.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

class MapDisplay {
 public:
  void addKeyframe(const Keyframe& keyframe);
  void apply(const MapUpdate& update);
  void clear();
  void setBase(const SE3& T_base_imu) { T_imu_base_ = T_base_imu.inverse(); }

  /// Keyframes' poses of base_link, oldest first.
  nav_msgs::Path path(const std_msgs::Header& header) const;
  /// Trajectory line, keyframe frusta, accepted loops as edges.
  visualization_msgs::MarkerArray markers(const std_msgs::Header& header) const;
  /// Landmarks: grey, or the colour of the plane they lie on.
  sensor_msgs::PointCloud2 landmarks(const std_msgs::Header& header) const;

  std::size_t keyframeCount() const { return keyframes_.size(); }
  std::size_t landmarkCount() const { return landmarks_.size(); }
  std::size_t planeLandmarkCount() const;
  std::size_t planeCount() const { return planes_.size(); }

 private:
  struct Shown {
    double t = 0;
    SE3 T_map_I;
  };
  struct Point {
    Eigen::Vector3f p;
    PlaneId plane;
  };
  std::map<KeyframeId, double> stamps_;
  std::map<KeyframeId, Shown> keyframes_;
  std::map<LandmarkId, Point> landmarks_;
  std::vector<std::pair<KeyframeId, KeyframeId>> loops_;  ///< accepted ones: query, match
  std::set<PlaneId> planes_;  ///< planes of the last global update, and those of local updates since
  SE3 T_imu_base_, T_imu_cam_;
};

}  // namespace vip_slam
