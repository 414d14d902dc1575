// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

SE3::SE3(const Eigen::Matrix4d& T)
    : q_(Eigen::Quaterniond(T.topLeftCorner<3, 3>()).normalized()), t_(T.topRightCorner<3, 1>()) {}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = R();
  T.topRightCorner<3, 1>() = t_;
  return T;
}

SE3 SE3::exp(const Vector6d& xi) {
  const Eigen::Vector3d theta = xi.head<3>();
  return SE3(expQuaternion(theta), leftJacobianSO3(theta) * xi.tail<3>());
}

Vector6d SE3::log() const {
  const Eigen::Vector3d theta = logSO3(q_);
  Vector6d xi;
  // J_l(theta)^-1 = J_r(-theta)^-1
  xi << theta, rightJacobianInverseSO3(-theta) * t_;
  return xi;
}

Matrix6d SE3::adjoint() const {
  const Eigen::Matrix3d rotation = R();
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = rotation;
  A.bottomRightCorner<3, 3>() = rotation;
  A.bottomLeftCorner<3, 3>() = hat(t_) * rotation;
  return A;
}

SE3 SE3::boxplus(const Vector6d& delta) const { return SE3(q_ * expQuaternion(delta.head<3>()), t_ + delta.tail<3>()); }

Vector6d SE3::boxminus(const SE3& reference) const {
  Vector6d delta;
  delta << logSO3(reference.q_.conjugate() * q_), t_ - reference.t_;
  return delta;
}

SE3 alignLevelled(const SE3& T_A_B, const SE3& T_C_B) {
  const Eigen::Matrix3d R = (T_A_B.rotation() * T_C_B.rotation().conjugate()).toRotationMatrix();
  const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  const Eigen::Quaterniond q(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return SE3(q, T_A_B.t() - q * T_C_B.t());
}

SE3 interpolate(const SE3& a, const SE3& b, double s) {
  return SE3(a.rotation().slerp(s, b.rotation()), (1.0 - s) * a.t() + s * b.t());
}

}  // namespace vip_slam
