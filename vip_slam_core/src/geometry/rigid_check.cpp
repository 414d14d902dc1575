// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/rigid_check.h"

#include <Eigen/LU>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

RigidTransform rigidTransform(const Eigen::Matrix4d& M) {
  constexpr double kExact = 1e-3, kRounded = 0.025, kLastRow = 1e-9;
  RigidTransform out;
  if (!M.allFinite()) {
    out.problem = "a number is not finite";
    return out;
  }
  if ((M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > kLastRow) {
    out.problem = formatted("the last row is %g %g %g %g, expected 0 0 0 1", M(3, 0), M(3, 1), M(3, 2), M(3, 3));
    return out;
  }
  const Eigen::Matrix3d R = M.topLeftCorner<3, 3>();
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(off < kRounded))
    out.problem = formatted("the rotation is off orthonormal by %.2g, expected less than %g", off, kRounded);
  else if (R.determinant() < 0)
    out.problem = "the rotation mirrors (determinant -1), expected determinant 1";
  if (!out.problem.empty()) return out;
  out.T = SE3(M);
  if (off < kExact) return out;
  out.note = formatted("the rotation is off orthonormal by %.2g, as when it is rounded: the nearest one is taken", off);
  out.T = SE3(nearestRotation(R), M.topRightCorner<3, 1>());
  return out;
}

}  // namespace vip_slam
