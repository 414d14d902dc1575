// SPDX-License-Identifier: BSD-3-Clause
// Infinite planes n^T x + d = 0 with |n| = 1, metres, and their manifold S^2 x R.
// Source: paper section "Notation"; closest-point (CP) vector as in Geneva et al. 2018. Here eta = n d with
// n^T x + d = 0, so eta is minus the plane's closest point to the origin. n is undefined at eta = 0, which is why
// the optimisers and messages have (n, d); toCp() and fromCp() are for exchange with code that has CP.
#pragma once

#include <Eigen/Core>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct Plane {
  Eigen::Vector3d n = Eigen::Vector3d::UnitZ();  ///< unit normal
  double d = 0.0;                                ///< metres; n^T x + d = 0

  Plane() = default;
  /// Normalises (n, d); n must not be zero.
  Plane(const Eigen::Vector3d& normal, double distance);
  static Plane fromPointNormal(const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

  double signedDistance(const Eigen::Vector3d& x) const { return n.dot(x) + d; }
  Eigen::Vector3d project(const Eigen::Vector3d& x) const { return x - signedDistance(x) * n; }
  Eigen::Vector4d coefficients() const { return Eigen::Vector4d(n.x(), n.y(), n.z(), d); }
  Plane flipped() const;

  /// eta = n d (paper); the same for (n, d) and (-n, -d).
  Eigen::Vector3d toCp() const { return n * d; }
  /// Throws std::invalid_argument when |eta| < 1e-9: the normal is then undefined.
  static Plane fromCp(const Eigen::Vector3d& eta);

  /// Three-parameter update (two in the tangent plane of n by tangentBasis(), one for d).
  Plane boxplus(const Eigen::Vector3d& delta) const;
  /// reference.boxplus(this->boxminus(reference)) == *this. Both on the same gauge (n . n' > 0).
  Eigen::Vector3d boxminus(const Plane& reference) const;
};

/// Orthonormal 3x2 basis of the tangent plane of unit vector n; smooth almost everywhere, deterministic.
Eigen::Matrix<double, 3, 2> tangentBasis(const Eigen::Vector3d& n);

/// pi_A from pi_B: pi_A = T_A_B^-T pi_B.
Plane transformPlane(const SE3& T_A_B, const Plane& plane_B);

/// Angle in [0, pi/2] between the planes, whatever the sign of their normals.
double angleBetween(const Plane& a, const Plane& b);

}  // namespace vip_slam
