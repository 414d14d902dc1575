// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/plane.h"

#include <cmath>
#include <stdexcept>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

Plane::Plane(const Eigen::Vector3d& normal, double distance) {
  const double length = normal.norm();
  if (!(length > 0))
    throw std::invalid_argument(
        formatted("plane normal: is (%g, %g, %g), expected a direction", normal.x(), normal.y(), normal.z()));
  n = normal / length;
  d = distance / length;
}

Plane Plane::fromPointNormal(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  Plane plane(normal, 0.0);
  plane.d = -plane.n.dot(point);
  return plane;
}

Plane Plane::flipped() const {
  Plane plane = *this;
  plane.n = -n;
  plane.d = -d;
  return plane;
}

Plane Plane::fromCp(const Eigen::Vector3d& eta) {
  const double distance = eta.norm();
  if (!(distance >= 1e-9)) {
    throw std::invalid_argument(
        formatted("closest-point vector: is (%g, %g, %g), expected a plane that does not contain the origin", eta.x(),
                  eta.y(), eta.z()));
  }
  return Plane(eta, distance * distance);
}

Plane Plane::boxplus(const Eigen::Vector3d& delta) const {
  const Eigen::Vector2d tangent = delta.head<2>();
  const double angle = tangent.norm();
  const double sinc = angle < 1e-9 ? 1.0 : std::sin(angle) / angle;
  Plane plane;
  plane.n = (std::cos(angle) * n + sinc * (tangentBasis(n) * tangent)).normalized();
  plane.d = d + delta.z();
  return plane;
}

Eigen::Vector3d Plane::boxminus(const Plane& reference) const {
  const Eigen::Vector2d tangent = tangentBasis(reference.n).transpose() * n;
  const double sine = tangent.norm();
  const double angle = std::atan2(sine, reference.n.dot(n));
  const Eigen::Vector2d delta = sine < 1e-12 ? tangent : Eigen::Vector2d(tangent * (angle / sine));
  return Eigen::Vector3d(delta.x(), delta.y(), d - reference.d);
}

Eigen::Matrix<double, 3, 2> tangentBasis(const Eigen::Vector3d& n) {
  // Duff et al. 2017, "Building an Orthonormal Basis, Revisited": its only seam is the sign change at n_z = 0.
  const double s = std::copysign(1.0, n.z());
  const double a = -1.0 / (s + n.z());
  const double b = n.x() * n.y() * a;
  Eigen::Matrix<double, 3, 2> B;
  B.col(0) << 1.0 + s * n.x() * n.x() * a, s * b, -s * n.x();
  B.col(1) << b, s + n.y() * n.y() * a, -n.y();
  return B;
}

Plane transformPlane(const SE3& T_A_B, const Plane& plane_B) {
  Plane plane_A;
  plane_A.n = (T_A_B.rotation() * plane_B.n).normalized();
  plane_A.d = plane_B.d - plane_A.n.dot(T_A_B.t());
  return plane_A;
}

double angleBetween(const Plane& a, const Plane& b) {
  // atan2 keeps its precision near 0, where acos of the dot product does not.
  return std::atan2(a.n.cross(b.n).norm(), std::abs(a.n.dot(b.n)));
}

}  // namespace vip_slam
