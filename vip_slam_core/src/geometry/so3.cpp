// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/so3.h"

#include <cmath>

#include <Eigen/SVD>

namespace vip_slam {
namespace {

// sin(x)/x
double sinc(double x) { return std::abs(x) < 1e-9 ? 1.0 : std::sin(x) / x; }

// (1 - cos x)/x^2, written with the half angle because 1 - cos x cancels near zero.
double versineOverSquare(double x) {
  const double s = sinc(0.5 * x);
  return 0.5 * s * s;
}

// (x - sin x)/x^3; below 0.3 the series is exact to rounding while the quotient cancels.
double sineDefectOverCube(double x) {
  if (std::abs(x) > 0.3) return (x - std::sin(x)) / (x * x * x);
  const double y = x * x;
  return 1.0 / 6 - y * (1.0 / 120 - y * (1.0 / 5040 - y * (1.0 / 362880 - y / 39916800.0)));
}

// (1 - (x/2) cot(x/2))/x^2
double cotangentTerm(double x) {
  if (std::abs(x) > 0.3) return (1.0 - 0.5 * x / std::tan(0.5 * x)) / (x * x);
  const double y = x * x;
  return 1.0 / 12 + y * (1.0 / 720 + y * (1.0 / 30240 + y * (1.0 / 1209600 + y / 47900160.0)));
}

}  // namespace

Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d expSO3(const Eigen::Vector3d& theta) {
  const double x = theta.norm();
  const Eigen::Matrix3d W = hat(theta);
  return Eigen::Matrix3d::Identity() + sinc(x) * W + versineOverSquare(x) * W * W;
}

Eigen::Quaterniond expQuaternion(const Eigen::Vector3d& theta) {
  const double half = 0.5 * theta.norm();
  const Eigen::Vector3d v = 0.5 * sinc(half) * theta;
  return Eigen::Quaterniond(std::cos(half), v.x(), v.y(), v.z()).normalized();
}

Eigen::Vector3d logSO3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const double w = sign * q.w();
  const Eigen::Vector3d v = sign * q.vec();
  const double n = v.norm();
  if (n < 1e-12) return (2.0 / w) * v;
  return (2.0 * std::atan2(n, w) / n) * v;
}

Eigen::Vector3d logSO3(const Eigen::Matrix3d& R) { return logSO3(Eigen::Quaterniond(R)); }

Eigen::Matrix3d leftJacobianSO3(const Eigen::Vector3d& theta) {
  const double x = theta.norm();
  const Eigen::Matrix3d W = hat(theta);
  return Eigen::Matrix3d::Identity() + versineOverSquare(x) * W + sineDefectOverCube(x) * W * W;
}

Eigen::Matrix3d rightJacobianSO3(const Eigen::Vector3d& theta) { return leftJacobianSO3(-theta); }

Eigen::Matrix3d rightJacobianInverseSO3(const Eigen::Vector3d& theta) {
  const Eigen::Matrix3d W = hat(theta);
  return Eigen::Matrix3d::Identity() + 0.5 * W + cotangentTerm(theta.norm()) * W * W;
}

Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).normalized();
}

double yawOf(const Eigen::Quaterniond& R_W_B) {
  const Eigen::Matrix3d R = R_W_B.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

Eigen::Quaterniond gravityAlignedRotation(const Eigen::Vector3d& up_B) {
  const Eigen::Quaterniond levelled = rotationBetween(up_B.normalized(), Eigen::Vector3d::UnitZ());
  // An x axis that points up has no heading; use the y axis then.
  const Eigen::Matrix3d R = levelled.toRotationMatrix();
  const bool x_upright = R.col(0).head<2>().norm() < 0.5;
  const double yaw = x_upright ? std::atan2(R(1, 1), R(0, 1)) - 0.5 * M_PI : yawOf(levelled);
  const Eigen::Quaterniond unyaw = expQuaternion(Eigen::Vector3d(0, 0, -yaw));
  return (unyaw * levelled).normalized();
}

Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace vip_slam
