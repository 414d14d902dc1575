// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/factors/relative_pose.h"

namespace vip_slam {

Vector6d relativePoseResidual(const SE3& T_W_i, const SE3& T_W_j, const SE3& T_i_j, Matrix6d* J_i, Matrix6d* J_j) {
  const Eigen::Matrix3d R_i_W = T_W_i.R().transpose();
  const Eigen::Vector3d t = R_i_W * (T_W_j.t() - T_W_i.t());
  Vector6d r;
  r.head<3>() = logSO3(T_i_j.rotation().conjugate() * T_W_i.rotation().conjugate() * T_W_j.rotation());
  r.tail<3>() = t - T_i_j.t();
  const Eigen::Matrix3d J_inv = rightJacobianInverseSO3(r.head<3>());
  if (J_i) {
    J_i->setZero();
    J_i->topLeftCorner<3, 3>() = -J_inv * T_W_j.R().transpose() * T_W_i.R();
    J_i->bottomLeftCorner<3, 3>() = hat(t);
    J_i->bottomRightCorner<3, 3>() = -R_i_W;
  }
  if (J_j) {
    J_j->setZero();
    J_j->topLeftCorner<3, 3>() = J_inv;
    J_j->bottomRightCorner<3, 3>() = R_i_W;
  }
  return r;
}

}  // namespace vip_slam
