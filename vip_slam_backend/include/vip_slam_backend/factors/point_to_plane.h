// SPDX-License-Identifier: BSD-3-Clause
// Depth points of one keyframe on a plane (paper section "Compressed Point-to-Plane Measurement", equations 8 and 9,
// corrected: points in the camera frame, camera pose): u = T_W_C^T pi = (R_C_W n, n.t_W_C + d), residual of a point w
// (u . [p_C; 1]); N points compress into G_p = sum w^2 p~ p~^T: cost C^cpp = 1/2 u^T G_p u.
#pragma once

#include <Eigen/Core>

#include "vip_slam_backend/factors/frame_geometry.h"
#include "vip_slam_core/geometry/plane.h"

namespace vip_slam {

/// Columns: theta, t (IMU pose), plane (two in the tangent plane of n, one for d).
using PlaneInCameraJacobian = Eigen::Matrix<double, 4, 9>;

/// The plane in the camera frame (n_C, d_C) as a 4-vector. `basis`: tangentBasis(plane.n), needed with J only.
inline Eigen::Vector4d planeInCamera(const FrameGeometry& frame, const Plane& plane,
                                     const Eigen::Matrix<double, 3, 2>* basis = nullptr,
                                     PlaneInCameraJacobian* J = nullptr) {
  Eigen::Vector4d u;
  u.head<3>() = frame.R_C_W * plane.n;
  u(3) = plane.n.dot(frame.t_W_C) + plane.d;
  if (J) {
    J->setZero();
    // R_C_I Exp(-dtheta) R_W_I^T n: d = R_C_I [R_W_I^T n]x.
    const Eigen::Vector3d n_I = frame.R_W_I.transpose() * plane.n;
    J->topLeftCorner<3, 3>() = frame.R_C_I * hat(n_I);
    // t_W_C = t + R Exp(dtheta) t_I_C: n . (-R [t_I_C]x dtheta).
    J->block<1, 3>(3, 0) = -n_I.transpose() * hat(frame.t_I_C);
    J->block<1, 3>(3, 3) = plane.n.transpose();
    J->block<3, 2>(0, 6) = frame.R_C_W * *basis;
    J->block<1, 2>(3, 6) = frame.t_W_C.transpose() * *basis;
    (*J)(3, 8) = 1.0;
  }
  return u;
}

/// Whether a finite G is symmetric and positive semidefinite up to rounding. Else decomposePointToPlane(), which drops
/// negative eigenvalues, would change its cost.
bool isSumOfSquares(const Eigen::Matrix4d& G);

/// Rows L^T with G = L L^T; eigenvalues below 1e-12 of the largest are dropped. Returns the number of rows.
int decomposePointToPlane(const Eigen::Matrix4d& G, Eigen::Matrix4d* rows);

}  // namespace vip_slam
