// SPDX-License-Identifier: BSD-3-Clause
// Horizontal and vertical planes (the paper's text on E_GBA, equation 11, names the prior, its sum lacks it):
// horizontal r = (n_x, n_y)/sigma, vertical r = n_z/sigma, sigma in radians. A general plane has no prior.
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Two rows (the second is zero for vertical planes, both for general ones); J with respect to the plane's tangent.
inline Eigen::Vector2d planePriorResidual(PlaneKind kind, const Plane& plane, double weight,
                                          const Eigen::Matrix<double, 3, 2>* basis = nullptr,
                                          Eigen::Matrix<double, 2, 3>* J = nullptr) {
  Eigen::Vector2d r = Eigen::Vector2d::Zero();
  if (J) J->setZero();
  if (kind == PlaneKind::kHorizontal) {
    r = weight * plane.n.head<2>();
    if (J) J->leftCols<2>() = weight * basis->topRows<2>();
  } else if (kind == PlaneKind::kVertical) {
    r(0) = weight * plane.n.z();
    if (J) J->block<1, 2>(0, 0) = weight * basis->row(2);
  }
  return r;
}

}  // namespace vip_slam
