// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/factors/point_to_plane.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace vip_slam {
namespace {

constexpr double kRounding = 1e-12;  // of the largest eigenvalue

}  // namespace

bool isSumOfSquares(const Eigen::Matrix4d& G) {
  const double rounding = kRounding * G.trace();
  if (!(rounding > 0)) return G.isZero(0);
  if ((G - G.transpose()).cwiseAbs().maxCoeff() > rounding) return false;
  return Eigen::LLT<Eigen::Matrix4d>(G + rounding * Eigen::Matrix4d::Identity()).info() == Eigen::Success;
}

int decomposePointToPlane(const Eigen::Matrix4d& G, Eigen::Matrix4d* rows) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(G);
  const double smallest = kRounding * std::max(eigen.eigenvalues()(3), 0.0);
  int count = 0;
  rows->setZero();
  for (int k = 3; k >= 0; --k)
    if (eigen.eigenvalues()(k) > smallest)
      rows->row(count++) = std::sqrt(eigen.eigenvalues()(k)) * eigen.eigenvectors().col(k).transpose();
  return count;
}

}  // namespace vip_slam
