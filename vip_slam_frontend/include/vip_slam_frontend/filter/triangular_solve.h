// Solutions with the filter's triangular factor, vectorised over the rows; rows that begin further right cost less.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

/// H <- H R^-1 (m x n), R upper triangular: H P H^T = Z Z^T. Used by the gate and for covariances.
void solveRight(const Eigen::MatrixXd& R, Eigen::MatrixXd& H);

/// r^T (H P H^T + I)^-1 r with P = R^-1 R^-T; H and r whitened.
double mahalanobis(const Eigen::MatrixXd& R, const Eigen::MatrixXd& H, const Eigen::VectorXd& r);

}  // namespace vip_slam
