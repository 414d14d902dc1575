// SPDX-License-Identifier: BSD-3-Clause
// A plane observed from a pose (third sum of E_PPG, equation 10 of the paper, corrected: pi_C = T_W_C^T pi_W and the
// difference on S^2 x R): r = ( B^T R^T n ,  n . t + d - d_m ) with B the tangent basis of the measured normal. The
// first two rows are the sine of the angle between predicted and measured normal, smooth everywhere; both normals must
// point to the same side (n . n_m > 0).
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/plane.h"

namespace vip_slam {

/// Raw residual; J_pose 3x6 (theta, t of T_W_F), J_plane 3x3 (tangent of plane_W).
Eigen::Vector3d posePlaneResidual(const SE3& T_W_F, const Plane& plane_W, const Plane& measured_F,
                                  Eigen::Matrix<double, 3, 6>* J_pose = nullptr, Eigen::Matrix3d* J_plane = nullptr);

}  // namespace vip_slam
