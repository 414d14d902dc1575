// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/factors/pose_plane.h"

namespace vip_slam {

Eigen::Vector3d posePlaneResidual(const SE3& T_W_F, const Plane& plane_W, const Plane& measured_F,
                                  Eigen::Matrix<double, 3, 6>* J_pose, Eigen::Matrix3d* J_plane) {
  const Eigen::Matrix<double, 2, 3> Bt = tangentBasis(measured_F.n).transpose();
  const Eigen::Matrix3d R_F_W = T_W_F.R().transpose();
  const Eigen::Vector3d n_F = R_F_W * plane_W.n;
  Eigen::Vector3d r;
  r.head<2>() = Bt * n_F;
  r(2) = plane_W.n.dot(T_W_F.t()) + plane_W.d - measured_F.d;
  if (J_pose) {
    J_pose->setZero();
    J_pose->topLeftCorner<2, 3>() = Bt * hat(n_F);
    J_pose->block<1, 3>(2, 3) = plane_W.n.transpose();
  }
  if (J_plane) {
    const Eigen::Matrix<double, 3, 2> B = tangentBasis(plane_W.n);
    J_plane->setZero();
    J_plane->topLeftCorner<2, 2>() = Bt * R_F_W * B;
    J_plane->block<1, 2>(2, 0) = T_W_F.t().transpose() * B;
    (*J_plane)(2, 2) = 1.0;
  }
  return r;
}

}  // namespace vip_slam
