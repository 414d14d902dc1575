// SPDX-License-Identifier: BSD-3-Clause
// Rotations: exponential map, logarithm and Jacobians of SO(3).
// Hamilton quaternions, right perturbation R <- R Exp(dtheta), radians throughout.
// Source: Forster et al. 2015. The IMU factor uses J_r and J_r^-1.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace vip_slam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// Skew-symmetric matrix [v]x with [v]x w = v x w.
Eigen::Matrix3d hat(const Eigen::Vector3d& v);

/// Rotation matrix Exp(theta); exact to machine precision for any |theta|, including 0.
Eigen::Matrix3d expSO3(const Eigen::Vector3d& theta);

/// Unit quaternion Exp(theta).
Eigen::Quaterniond expQuaternion(const Eigen::Vector3d& theta);

/// Rotation vector with |theta| <= pi. q and -q give the same result.
Eigen::Vector3d logSO3(const Eigen::Quaterniond& q);
Eigen::Vector3d logSO3(const Eigen::Matrix3d& R);

/// Right Jacobian: Exp(theta + d) ~ Exp(theta) Exp(J_r(theta) d).
Eigen::Matrix3d rightJacobianSO3(const Eigen::Vector3d& theta);
/// Inverse of the right Jacobian; |theta| < 2 pi.
Eigen::Matrix3d rightJacobianInverseSO3(const Eigen::Vector3d& theta);
/// Left Jacobian: Exp(theta + d) ~ Exp(J_l(theta) d) Exp(theta); J_l(theta) = J_r(-theta).
Eigen::Matrix3d leftJacobianSO3(const Eigen::Vector3d& theta);

/// The rotation that takes unit vector `from` to unit vector `to` by the shortest arc.
Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Yaw about z of R_W_B in ]-pi, pi] (ZYX convention), the heading of its x axis; undefined where that points up.
double yawOf(const Eigen::Quaterniond& R_W_B);

/// R_W_B of a levelled world: the rotation with R * up_B = (0,0,1) and yaw(R) = 0; for a body whose x axis points up
/// (within 30 degrees) the one with its y axis along the world's y.
/// `up_B` is the measured specific force of a body at rest (points up), any positive length.
Eigen::Quaterniond gravityAlignedRotation(const Eigen::Vector3d& up_B);

/// The rotation R that maximises the trace of R^T M: the nearest one to M, and Kabsch's for M = sum to_i from_i^T
/// (to ~ R from, both about their means).
Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& M);

}  // namespace vip_slam
