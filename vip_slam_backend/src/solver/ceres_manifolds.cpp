// SPDX-License-Identifier: BSD-3-Clause
#include "ceres_factors.h"

namespace vip_slam {
namespace {

using RowMajor76 = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
using RowMajor67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

}  // namespace

bool PoseManifold::Plus(const double* x, const double* delta, double* out) const {
  const SE3 T = poseOf(x).boxplus(Eigen::Map<const Vector6d>(delta));
  Eigen::Map<Eigen::Vector4d>(out, 4) = T.rotation().coeffs();
  Eigen::Map<Eigen::Vector3d>(out + 4, 3) = T.t();
  return true;
}

bool PoseManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<RowMajor76> J(jacobian);
  J.setZero();
  J.topRows<6>().setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* out) const {
  Eigen::Map<Vector6d>(out, 6) = poseOf(y).boxminus(poseOf(x));
  return true;
}

bool PoseManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<RowMajor67> J(jacobian);
  J.setZero();
  J.leftCols<6>().setIdentity();
  return true;
}

bool PlaneManifold::Plus(const double* x, const double* delta, double* out) const {
  const Plane plane = planeOf(x).boxplus(Eigen::Vector3d(delta[0], delta[1], delta[2]));
  Eigen::Map<Eigen::Vector4d>(out, 4) = plane.coefficients();
  return true;
}

bool PlaneManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 2>() = tangentBasis(Eigen::Vector3d(x[0], x[1], x[2]));
  J(3, 2) = 1;
  return true;
}

bool PlaneManifold::Minus(const double* y, const double* x, double* out) const {
  Eigen::Map<Eigen::Vector3d>(out, 3) = planeOf(y).boxminus(planeOf(x));
  return true;
}

bool PlaneManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<2, 3>() = tangentBasis(Eigen::Vector3d(x[0], x[1], x[2])).transpose();
  J(2, 3) = 1;
  return true;
}

}  // namespace vip_slam
