// SPDX-License-Identifier: BSD-3-Clause
// Central differences for the tests of analytic Jacobians.
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace vip_slam::testing {

/// d f / d delta at delta = 0, column by column; f takes a perturbation of size `dimension`.
template <class F>
Eigen::MatrixXd numericJacobian(F&& f, int dimension, double step = 1e-6) {
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(dimension);
  Eigen::MatrixXd J;
  for (int k = 0; k < dimension; ++k) {
    delta[k] = step;
    const Eigen::VectorXd plus = f(delta);
    delta[k] = -step;
    const Eigen::VectorXd minus = f(delta);
    delta[k] = 0;
    if (k == 0) J.resize(plus.size(), dimension);
    J.col(k) = (plus - minus) / (2 * step);
  }
  return J;
}

/// The largest error of a row relative to that row's largest entry in `b`, absolute where the row is zero: of stacked
/// Jacobians whose rows have different units, a small row counts as much as a large one.
inline double rowError(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  double largest = 0;
  for (int r = 0; r < b.rows(); ++r) {
    const double error = (a.row(r) - b.row(r)).cwiseAbs().maxCoeff(), size = b.row(r).cwiseAbs().maxCoeff();
    largest = std::max(largest, size > 0 ? error / size : error);
  }
  return largest;
}

}  // namespace vip_slam::testing
