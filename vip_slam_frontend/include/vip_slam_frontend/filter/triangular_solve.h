// SPDX-License-Identifier: BSD-3-Clause
// Solves with the filter's triangular factor, vectorised over the rows; rows with leading zeros cost less.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

/// H <- H R^-1 (m x n), R upper triangular: H P H^T = Z Z^T. Used by the gate and for covariances.
void solveRight(const Eigen::MatrixXd& R, Eigen::MatrixXd& H);

/// Effect of rows H, r on the state if applied alone; both whitened, P = R^-1 R^-T, S = H P H^T + I.
struct Innovation {
  double distance = 0;       ///< r^T S^-1 r, expected to be the number of rows
  double pull = 0;           ///< dx^T P^-1 dx of the correction dx = P H^T S^-1 r
  double expected_pull = 0;  ///< its expectation, trace(I - S^-1): how many directions of the state the rows measure
};
Innovation testInnovation(const Eigen::MatrixXd& R, const Eigen::MatrixXd& H, const Eigen::VectorXd& r);

}  // namespace vip_slam
