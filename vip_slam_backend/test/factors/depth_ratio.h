// SPDX-License-Identifier: BSD-3-Clause
// Depth ratio of a pair of views of a plane, where a homography of them may be a factor.
#pragma once

#include <cmath>

#include "vip_slam_backend/factors/homography.h"

namespace vip_slam {

/// z_j / z_i of the plane's point at xy_i; false when the geometry is too weak for a factor.
inline bool depthRatio(const FrameGeometry& i, const FrameGeometry& j, const Plane& plane, const Eigen::Vector2d& xy_i,
                       double* rho) {
  if (!mayHost(i.R_C_W * plane.n, plane.signedDistance(i.t_W_C), xy_i)) return false;
  *rho = transfer(homographyVector(i, j, plane), xy_i).z();
  return *rho > 0;
}

}  // namespace vip_slam
