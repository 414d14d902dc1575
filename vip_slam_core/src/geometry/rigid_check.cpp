#include "vip_slam_core/geometry/rigid_check.h"

#include <Eigen/LU>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

std::string rigidProblem(const Eigen::Matrix4d& T) {
  constexpr double kOrthonormal = 1e-3, kLastRow = 1e-9;
  if (!T.allFinite()) return "a number is not finite";
  if ((T.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > kLastRow)
    return formatted("the last row is %g %g %g %g, expected 0 0 0 1", T(3, 0), T(3, 1), T(3, 2), T(3, 3));
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(off < kOrthonormal))
    return formatted("the rotation is off orthonormal by %.2g, expected less than %g", off, kOrthonormal);
  if (R.determinant() < 0) return "the rotation mirrors (determinant -1), expected determinant 1";
  return "";
}

}  // namespace vip_slam
