// SPDX-License-Identifier: BSD-3-Clause
// Relative pose of two frames (first two sums of E_PPG, equation 10 of the paper, corrected: inverse instead of
// transpose, rotation as a logarithm): with T_i_j measured,
//   r_theta = Log(R_ij^T R_i^T R_j),  r_t = R_i^T (t_j - t_i) - t_ij.
// The adjustments use it for the odometry's motion between keyframes as well, which the paper does not have.
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// Raw residual (theta, t); 6x6 Jacobians with respect to the perturbations (theta, t) of both poses.
Vector6d relativePoseResidual(const SE3& T_W_i, const SE3& T_W_j, const SE3& T_i_j, Matrix6d* J_i = nullptr,
                              Matrix6d* J_j = nullptr);

}  // namespace vip_slam
