// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/shared_depth.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace vip_slam::frontend {
namespace {

double correlation(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::exp(-(a - b).norm() / kDepthCorrelationLength);
}

}  // namespace

std::vector<double> depthSharing(const std::vector<Eigen::Vector2d>& places) {
  std::vector<double> sharing(places.size(), 1.0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double common = correlation(places[i], places[j]);
      sharing[i] += common;
      sharing[j] += common;
    }
  }
  return sharing;
}

void decorrelateDepth(const std::vector<DepthRow>& depths, Eigen::MatrixXd* H_x, Eigen::MatrixXd* H_f,
                      Eigen::VectorXd* r) {
  // In the reverse order U is the lower Cholesky factor: place k there is depth n - 1 - k.
  const int n = static_cast<int>(depths.size());
  Eigen::MatrixXd reversed = Eigen::MatrixXd::Identity(n, n);
  for (int k = 0; k < n; ++k) {
    const DepthRow& a = depths[n - 1 - k];
    for (int m = 0; m <= k; ++m) {
      const DepthRow& b = depths[n - 1 - m];
      reversed(k, m) += a.shared * b.shared * correlation(a.xy, b.xy);
    }
  }
  const Eigen::MatrixXd L = reversed.llt().matrixL();
  for (int k = 0; k < n; ++k) {
    const int row = depths[n - 1 - k].row;
    for (int m = 0; m < k; ++m) {
      const int later = depths[n - 1 - m].row;
      H_x->row(row) -= L(k, m) * H_x->row(later);
      H_f->row(row) -= L(k, m) * H_f->row(later);
      (*r)(row) -= L(k, m) * (*r)(later);
    }
    H_x->row(row) /= L(k, k);
    H_f->row(row) /= L(k, k);
    (*r)(row) /= L(k, k);
  }
}

}  // namespace vip_slam::frontend
