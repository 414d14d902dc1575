// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/shared_depth.h"

#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/depth/depth_noise.h"

namespace vip_slam::frontend {
namespace {

double correlation(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::exp(-(a - b).norm() / kDepthCorrelationLength);
}

}  // namespace

void decorrelateDepth(const std::vector<DepthRow>& depths, Eigen::MatrixXd* H_x, Eigen::MatrixXd* H_f,
                      Eigen::VectorXd* r) {
  // In the reverse order U is the lower Cholesky factor.
  const int n = static_cast<int>(depths.size()), width = static_cast<int>(H_x->cols());
  if (n == 0) return;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd rows(n, width + 4);
  for (int k = 0; k < n; ++k) {
    const DepthRow& a = depths[n - 1 - k];
    for (int m = 0; m <= k; ++m) {
      const DepthRow& b = depths[n - 1 - m];
      covariance(k, m) += a.shared * b.shared * correlation(a.xy, b.xy);
    }
    rows.row(k) << H_x->row(a.row), H_f->row(a.row), (*r)(a.row);
  }
  covariance.llt().matrixL().solveInPlace(rows);
  for (int k = 0; k < n; ++k) {
    const int row = depths[n - 1 - k].row;
    H_x->row(row) = rows.row(k).head(width);
    H_f->row(row) = rows.row(k).segment<3>(width);
    (*r)(row) = rows(k, width + 3);
  }
}

}  // namespace vip_slam::frontend
