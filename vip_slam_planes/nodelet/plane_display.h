// SPDX-License-Identifier: BSD-3-Clause
// Planes for rviz.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

class PlaneDisplay {
 public:
  /// Translucent polygons with outlines: grey when horizontal, else one colour per plane. Markers of planes that no
  /// longer exist are deleted.
  visualization_msgs::MarkerArray markers(const std::vector<PlaneEstimate>& planes, const std_msgs::Header& header,
                                          double opacity);

  /// Stores the poses and points needed to draw the depth points on planes.
  void apply(const MapUpdate& update);
  void apply(const PlaneUpdate& update);
  /// The depth points on planes, in the colours of the planes; the mean of each plane's points in a cube of side
  /// `voxel`, metres (0: all points).
  sensor_msgs::PointCloud2 cloud(const std_msgs::Header& header, double voxel) const;
  std::size_t points() const;
  void clear();

 private:
  std::set<PlaneId> shown_;
  std::set<PlaneId> horizontal_;
  std::map<KeyframeId, SE3> keyframes_;  ///< T_map_C, with the present camera-IMU extrinsics
  std::map<PlaneId, std::map<KeyframeId, std::vector<Eigen::Vector3f>>> points_;
};

}  // namespace vip_slam
