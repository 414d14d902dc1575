// SPDX-License-Identifier: BSD-3-Clause
// Reprojection and depth of a point seen by a keyframe (paper section "IMU and Point Feature Measurement", equation 2,
// r^C and r^C_lambda): p_C = R_C_I (R_W_I^T (p_W - t_W_I) - t_I_C), r = (x/z - u, y/z - v), r_depth = z - lambda.
//   d p_C / d p_W = R_C_W,  d p_C / d t = -R_C_W,  d p_C / d theta = R_C_I [R_W_I^T (p_W - t_W_I)]x.
#pragma once

#include <Eigen/Core>

#include "vip_slam_backend/factors/frame_geometry.h"

namespace vip_slam {

/// Nearest depth at which a projection counts; nearer (or behind) the factor is switched off for this evaluation.
constexpr double kMinProjectionDepth = 0.05;

/// Residual in normalised coordinates times `weight` (focal length / sigma in px). False when the point is not in
/// front. J_pose 2x6 (theta, t), J_point 2x3; both or none.
inline bool reprojectionResidual(const FrameGeometry& frame, const Eigen::Vector3d& p_W, const Eigen::Vector2d& xy,
                                 double weight, Eigen::Vector2d* r, Eigen::Matrix<double, 2, 6>* J_pose = nullptr,
                                 Eigen::Matrix<double, 2, 3>* J_point = nullptr) {
  const Eigen::Vector3d q = frame.R_W_I.transpose() * (p_W - frame.t_W_I);
  const Eigen::Vector3d p = frame.R_C_I * (q - frame.t_I_C);
  if (p.z() < kMinProjectionDepth) return false;
  const double inv_z = 1.0 / p.z(), x = p.x() * inv_z, y = p.y() * inv_z;
  *r = weight * Eigen::Vector2d(x - xy.x(), y - xy.y());
  if (J_pose) {
    Eigen::Matrix<double, 2, 3> D;
    D << inv_z, 0, -x * inv_z, 0, inv_z, -y * inv_z;
    D *= weight;
    *J_point = D * frame.R_C_W;
    J_pose->leftCols<3>() = D * frame.R_C_I * hat(q);
    J_pose->rightCols<3>() = -*J_point;
  }
  return true;
}

/// (z - depth) * weight with weight = 1 / sigma_lambda. J_pose 1x6, J_point 1x3; both or none.
inline double depthResidual(const FrameGeometry& frame, const Eigen::Vector3d& p_W, double depth, double weight,
                            Eigen::Matrix<double, 1, 6>* J_pose = nullptr,
                            Eigen::Matrix<double, 1, 3>* J_point = nullptr) {
  const Eigen::Vector3d q = frame.R_W_I.transpose() * (p_W - frame.t_W_I);
  const double z = frame.R_C_I.row(2).dot(q - frame.t_I_C);
  if (J_pose) {
    *J_point = weight * frame.R_C_W.row(2);
    J_pose->leftCols<3>() = weight * frame.R_C_I.row(2) * hat(q);
    J_pose->rightCols<3>() = -*J_point;
  }
  return weight * (z - depth);
}

}  // namespace vip_slam
