// SPDX-License-Identifier: BSD-3-Clause
// In-place Householder triangularisations for the square-root filter. Columns are contiguous (Eigen's default), the
// inner loops run along rows, so they vectorise; four reflectors are applied at once.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

/// Triangularises the first `pivots` columns of A in place: on return A = Q^T A with zeros below the diagonal of these
/// columns; all further columns are transformed along. Diagonal entries come out >= 0. Columns whose remaining norm is
/// below epsilon (of doubles) times the largest entry in A are skipped (rank deficiency): their rows below stay as they
/// are zero to that accuracy.
void triangularise(Eigen::MatrixXd& A, int pivots);

/// [R; H] -> [R'; 0] with the right-hand sides [r; h] -> [r'; e], exploiting that R (n x n) is upper triangular.
/// H (m x n) is overwritten; it costs least when rows that begin further right come last. On return |e|^2 is the part
/// of the residual that the state cannot explain.
void stackTriangular(Eigen::MatrixXd& R, Eigen::VectorXd& r, Eigen::MatrixXd& H, Eigen::VectorXd& h);

}  // namespace vip_slam
