// SPDX-License-Identifier: BSD-3-Clause
// Rigid transforms. T_A_B maps points of B into A: p_A = T_A_B * p_B.
// The estimators perturb T with R <- R Exp(dtheta), t <- t + dt (dt in the target frame); see boxplus().
#pragma once

#include "vip_slam_core/geometry/so3.h"

namespace vip_slam {

class SE3 {
 public:
  SE3() : q_(Eigen::Quaterniond::Identity()), t_(Eigen::Vector3d::Zero()) {}
  SE3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) : q_(q.normalized()), t_(t) {}
  SE3(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) : q_(Eigen::Quaterniond(R).normalized()), t_(t) {}
  explicit SE3(const Eigen::Matrix4d& T);

  const Eigen::Quaterniond& rotation() const { return q_; }
  Eigen::Matrix3d R() const { return q_.toRotationMatrix(); }
  const Eigen::Vector3d& t() const { return t_; }
  Eigen::Vector3d& t() { return t_; }
  void setRotation(const Eigen::Quaterniond& q) { q_ = q.normalized(); }

  Eigen::Matrix4d matrix() const;
  SE3 inverse() const {
    const Eigen::Quaterniond qi = q_.conjugate();
    return SE3(qi, -(qi * t_));
  }
  SE3 operator*(const SE3& o) const { return SE3(q_ * o.q_, t_ + q_ * o.t_); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return q_ * p + t_; }

  /// Group exponential and logarithm, tangent order (rotation, translation).
  static SE3 exp(const Vector6d& xi);
  Vector6d log() const;
  /// Adj(T): T Exp(xi) T^-1 = Exp(Adj(T) xi), order (rotation, translation).
  Matrix6d adjoint() const;

  /// The estimators' perturbation: R Exp(dtheta), t + dt. delta = (dtheta, dt).
  SE3 boxplus(const Vector6d& delta) const;
  /// Inverse of boxplus: reference.boxplus(this->boxminus(reference)) == *this.
  Vector6d boxminus(const SE3& reference) const;

  bool isFinite() const { return q_.coeffs().allFinite() && t_.allFinite(); }

 private:
  Eigen::Quaterniond q_;
  Eigen::Vector3d t_;
};

/// T_A_C, a rotation about z and a translation, for two levelled worlds in which the same body has the poses T_A_B and
/// T_C_B: the rotation that aligns the two orientations best, for any orientation of the body (the heading would be
/// undefined for an x axis that points up).
SE3 alignLevelled(const SE3& T_A_B, const SE3& T_C_B);

/// Interpolates a (s=0) to b (s=1): slerp and lerp.
SE3 interpolate(const SE3& a, const SE3& b, double s);

}  // namespace vip_slam
