// SPDX-License-Identifier: BSD-3-Clause
// The pose-plane graph (paper section "Loop Detection and Pose Plane Graph Optimization", corrected residuals: see
// factors/relative_pose.h and factors/pose_plane.h). Poses have yaw and position as variables; roll and pitch are
// fixed, since the IMU observes them. Planes are variables on S^2 x R. ROS-free and independent of the map.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/feature.h"

namespace vip_slam {

struct RelativePoseEdge {
  KeyframeId i = 0, j = 0;
  SE3 T_i_j;                  ///< measured, IMU frames
  Matrix6d sqrt_information;  ///< of the residual (theta, t)
};

struct PosePlaneEdge {
  KeyframeId i = 0;
  PlaneId plane = 0;
  Plane measured_I;  ///< in the IMU frame of i
  Eigen::Matrix3d sqrt_information;
};

struct PosePlaneSolution {
  bool usable = false;
  std::map<KeyframeId, SE3> T_W_I;
  std::map<PlaneId, Plane> planes;
  double chi2 = 0;  ///< sum of whitened squares over all edges
  int iterations = 0;
};

class PosePlaneGraph {
 public:
  /// A node with an id in use replaces that node. Edges to unknown nodes throw std::invalid_argument.
  void addPose(KeyframeId id, const SE3& T_W_I) { poses_[id] = T_W_I; }
  void addPlane(PlaneId id, const Plane& plane_W) { planes_[id] = plane_W; }
  void addEdge(const RelativePoseEdge& edge);
  void addEdge(const PosePlaneEdge& edge);

  /// Optimises from the poses given; the lowest id of each connected part is fixed.
  PosePlaneSolution solve(int max_iterations) const;
  /// Covariance of the position of `to` in the frame of `from`, m^2, along the edges between poses that know it best:
  /// an upper bound of that of the whole graph. Roll and pitch are known. Nothing when no edges lead there.
  std::optional<Eigen::Matrix3d> positionCovariance(KeyframeId from, KeyframeId to) const;

 private:
  std::map<KeyframeId, SE3> poses_;
  std::map<PlaneId, Plane> planes_;
  std::vector<RelativePoseEdge> relative_;
  std::vector<PosePlaneEdge> pose_plane_;
};

}  // namespace vip_slam
