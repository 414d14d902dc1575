// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/relative_motion.h"

#include <Eigen/Cholesky>

namespace vip_slam {

bool RelativeMotion::isUsable() const {
  return T_a_b.isFinite() && covariance.allFinite() &&
         (covariance - covariance.transpose()).norm() <= 1e-6 * covariance.norm() &&
         covariance.llt().info() == Eigen::Success;
}

RelativeMotion compose(const RelativeMotion& ab, const RelativeMotion& bc) {
  RelativeMotion ac;
  if (!ab.known() || !bc.known()) return ac;
  ac.T_a_b = ab.T_a_b * bc.T_a_b;
  const Eigen::Matrix3d R_ab = ab.T_a_b.R();
  Matrix6d J_ab = Matrix6d::Identity(), J_bc = Matrix6d::Identity();
  J_ab.topLeftCorner<3, 3>() = bc.T_a_b.R().transpose();
  J_ab.bottomLeftCorner<3, 3>() = -R_ab * hat(bc.T_a_b.t());
  J_bc.bottomRightCorner<3, 3>() = R_ab;
  ac.covariance = J_ab * ab.covariance * J_ab.transpose() + J_bc * bc.covariance * J_bc.transpose();
  return ac;
}

}  // namespace vip_slam
