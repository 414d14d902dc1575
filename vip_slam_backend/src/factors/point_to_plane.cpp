#include "vip_slam_backend/factors/point_to_plane.h"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace vip_slam {

int decomposePointToPlane(const Eigen::Matrix4d& G, Eigen::Matrix4d* rows) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(G);
  const double smallest = 1e-12 * std::max(eigen.eigenvalues()(3), 0.0);
  int count = 0;
  rows->setZero();
  for (int k = 3; k >= 0; --k)
    if (eigen.eigenvalues()(k) > smallest)
      rows->row(count++) = std::sqrt(eigen.eigenvalues()(k)) * eigen.eigenvectors().col(k).transpose();
  return count;
}

}  // namespace vip_slam
