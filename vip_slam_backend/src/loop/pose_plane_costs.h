// SPDX-License-Identifier: BSD-3-Clause
// Ceres cost functions of the pose-plane graph. Parameter blocks: keyframe 4 (yaw relative to the rotation R that it
// started with, position), plane 4 (n, d).
#pragma once

#include <ceres/ceres.h>

#include "../solver/ceres_manifold.h"
#include "vip_slam_backend/loop/pose_plane_graph.h"

namespace vip_slam {

/// The pose of a keyframe's parameter block.
SE3 poseAt(const Eigen::Quaterniond& R, const double* x);

/// Blocks: keyframes i and j.
ceres::CostFunction* makeEdgeCost(const RelativePoseEdge& edge, const Eigen::Quaterniond& R_i,
                                  const Eigen::Quaterniond& R_j);
/// Blocks: keyframe i and the plane.
ceres::CostFunction* makeEdgeCost(const PosePlaneEdge& edge, const Eigen::Quaterniond& R);

/// Of a plane's block; Plane::boxplus has another tangent basis.
CeresManifold* makePlaneManifold();

}  // namespace vip_slam
