// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/square_root_filter.h"

#include <algorithm>

#include <Eigen/Jacobi>

#include "vip_slam_frontend/filter/qr.h"
#include "vip_slam_frontend/filter/triangular_solve.h"

namespace vip_slam {

Eigen::MatrixXd marginaliseColumns(const Eigen::MatrixXd& A, const std::vector<int>& order, int k) {
  const int n = static_cast<int>(A.cols());
  Eigen::MatrixXd permuted(A.rows(), n);
  for (int c = 0; c < n; ++c) permuted.col(c) = A.col(order[c]);
  triangularise(permuted, n);
  return permuted.block(k, k, n - k, n - k).triangularView<Eigen::Upper>();
}

void SquareRootFilter::initialise(const WindowState& window, const Eigen::MatrixXd& rows) {
  window_ = window;
  Eigen::MatrixXd A = rows;
  const int n = window.dimension();
  triangularise(A, n);
  R_ = A.topLeftCorner(n, n).triangularView<Eigen::Upper>();
}

void SquareRootFilter::augment(const Propagation& propagation, CloneId id, double delay_change) {
  const int n = window_.dimension();
  const int last_clone = window_.cloneColumn(static_cast<int>(window_.clones.size()) - 1);
  const int nav = window_.navColumn();

  // Rows of the old factor, then W [-Phi I] on (C_k, E_k ; C_k+1, E_k+1), appended behind the old columns, and the
  // delay's change behind these.
  const int changed = delay_change > 0 && window_.calibration.time_offset ? 1 : 0;
  const int delay = window_.timeOffsetColumn();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + 15 + changed, n + 15 + changed);
  A.topLeftCorner(n, n) = R_;
  const Matrix15d WPhi = propagation.W * propagation.Phi;
  A.block<15, 6>(n, last_clone) = -WPhi.leftCols<6>();
  A.block<15, 9>(n, nav) = -WPhi.rightCols<9>();
  A.block<15, 15>(n, n) = propagation.W;
  const Eigen::Matrix<double, 15, 9> W_gyro = propagation.W * propagation.Phi_gyro;
  for (int k = 0; k < window_.calibration.gyro(); ++k) {
    const auto [row, column] = gyroEntry(window_.calibration, k);
    A.block<15, 1>(n, window_.gyroColumn() + k) = -W_gyro.col(3 * column + row);
  }

  if (changed) {
    A(n + 15, n + 15) = 1.0 / delay_change;
    A(n + 15, delay) = -1.0 / delay_change;
  }

  std::vector<int> order;
  order.reserve(n + 16);
  for (int c = nav; c < n; ++c) order.push_back(c);                          // E_k goes
  if (changed) order.push_back(delay);                                       // and the delay before its change
  for (int c = 0; c < window_.calibrationColumn(); ++c) order.push_back(c);  // clones
  for (int c = n; c < n + 6; ++c) order.push_back(c);                        // C_k+1
  for (int c = window_.calibrationColumn(); c < nav; ++c) order.push_back(changed && c == delay ? n + 15 : c);
  for (int c = n + 6; c < n + 15; ++c) order.push_back(c);  // E_k+1
  R_ = marginaliseColumns(A, order, 9 + changed);

  Clone clone;
  clone.id = id;
  clone.t = propagation.predicted.t;
  clone.T_W_I = clone.T_W_I_fej = propagation.predicted.T_W_I;
  clone.omega_I = propagation.omega_I;
  clone.v_W = propagation.predicted.v_W;
  clone.time_offset = window_.time_offset;
  window_.clones.push_back(clone);
  window_.v_W = window_.v_W_fej = propagation.predicted.v_W;
  window_.rates = propagation.rates;
}

void SquareRootFilter::marginalise(const std::vector<int>& clone_indices) {
  if (clone_indices.empty()) return;
  const int n = window_.dimension();
  const int k = 6 * static_cast<int>(clone_indices.size());
  bool oldest_only = true;
  for (std::size_t i = 0; i < clone_indices.size(); ++i) oldest_only &= clone_indices[i] == static_cast<int>(i);
  if (oldest_only) {
    R_ = Eigen::MatrixXd(R_.bottomRightCorner(n - k, n - k));
  } else {
    std::vector<bool> goes(n, false);
    std::vector<int> order;
    for (int index : clone_indices) {
      for (int c = 0; c < 6; ++c) {
        order.push_back(6 * index + c);
        goes[6 * index + c] = true;
      }
    }
    for (int c = 0; c < n; ++c) {
      if (!goes[c]) order.push_back(c);
    }
    R_ = marginaliseColumns(R_, order, k);
  }
  for (std::size_t i = clone_indices.size(); i-- > 0;) {
    window_.clones.erase(window_.clones.begin() + clone_indices[i]);
  }
}

double SquareRootFilter::sigma(int column) const {
  Eigen::VectorXd row = Eigen::VectorXd::Unit(window_.dimension(), column);
  R_.transpose().triangularView<Eigen::Lower>().solveInPlace(row);
  return row.norm();
}

void SquareRootFilter::consider(int column, double change, double sigma) {
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(window_.dimension());
  delta(column) = change;
  window_.boxplus(delta);
  // As after a process noise: the covariance with the others stays.
  const double now = this->sigma(column), lost = sigma * sigma - now * now;
  if (!(lost > 0)) return;
  inflate(std::sqrt(lost) * Eigen::VectorXd::Unit(window_.dimension(), column));
}

void SquareRootFilter::inflate(const Eigen::MatrixXd& N) {
  const int n = static_cast<int>(N.rows()), k = static_cast<int>(N.cols());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + k, n + k);  // the last columns: the unit variables
  A.topLeftCorner(n, n) = R_;
  A.topRightCorner(n, k) = -R_ * N;
  A.bottomRightCorner(k, k).setIdentity();
  std::vector<int> order;
  for (int c = n; c < n + k; ++c) order.push_back(c);
  for (int c = 0; c < n; ++c) order.push_back(c);
  R_ = marginaliseColumns(A, order, k);
}

void SquareRootFilter::replaceMarginal(int column, const Eigen::VectorXd& change, const Eigen::VectorXd& sigmas) {
  // With these columns last, the upper rows hold the conditional of the others given them, the last rows their
  // marginal.
  const int n = window_.dimension(), k = static_cast<int>(change.size()), others = n - k;
  const auto rotate = [this, n](int pivot, int from) {  // makes (pivot + 1, from) zero
    Eigen::JacobiRotation<double> rotation;
    rotation.makeGivens(R_(pivot, from), R_(pivot + 1, from));
    R_.rightCols(n - std::min(from, pivot)).applyOnTheLeft(pivot, pivot + 1, rotation.adjoint());
    R_(pivot + 1, from) = 0;
  };
  for (int i = 0; i < k; ++i) {
    const Eigen::VectorXd moved = R_.col(column);
    for (int c = column; c + 1 < n; ++c) R_.col(c) = R_.col(c + 1).eval();
    R_.col(n - 1) = moved;
    for (int c = column; c + 1 < n; ++c) rotate(c, c);
  }
  R_.bottomRightCorner(k, k) = sigmas.cwiseInverse().asDiagonal();

  Eigen::VectorXd follow = -R_.topRightCorner(others, k) * change;
  R_.topLeftCorner(others, others).triangularView<Eigen::Upper>().solveInPlace(follow);
  Eigen::VectorXd delta(n);
  delta << follow.head(column), change, follow.tail(others - column);

  for (int i = 0; i < k; ++i) {
    const Eigen::VectorXd last = R_.col(n - 1);
    for (int c = n - 1; c > column; --c) R_.col(c) = R_.col(c - 1).eval();
    R_.col(column) = last;
    for (int r = n - 2; r >= column; --r) rotate(r, column);
  }
  for (int r = column; r < n; ++r) {
    if (R_(r, r) < 0) R_.row(r) = -R_.row(r);
  }
  window_.boxplus(delta);
}

UpdateResult SquareRootFilter::update(Eigen::MatrixXd& H, Eigen::VectorXd& h) {
  UpdateResult result;
  result.rows = static_cast<int>(H.rows());
  if (H.rows() == 0) return result;
  Eigen::MatrixXd R = R_;
  Eigen::VectorXd r = Eigen::VectorXd::Zero(R.rows());
  stackTriangular(R, r, H, h);
  result.delta = R.triangularView<Eigen::Upper>().solve(r);
  result.nis = h.squaredNorm();
  if (!result.delta.allFinite() || !R.diagonal().allFinite()) return result;
  R_.swap(R);
  window_.boxplus(result.delta);
  result.ok = true;
  return result;
}

void SquareRootFilter::relinearise() {
  for (Clone& clone : window_.clones) clone.T_W_I_fej = clone.T_W_I;
  window_.v_W_fej = window_.v_W;
}

Eigen::MatrixXd SquareRootFilter::covariance(int column, int size) const {
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(size, window_.dimension());
  Y.middleCols(column, size).setIdentity();
  solveRight(R_, Y);
  return Y * Y.transpose();
}

Eigen::VectorXd SquareRootFilter::calibrationSigmas() const {
  const int size = window_.calibration.size();
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(size, window_.dimension());
  Y.middleCols(window_.calibrationColumn(), size).setIdentity();
  solveRight(R_, Y);
  return Y.rowwise().norm();
}

Matrix15d SquareRootFilter::navCovariance() const {
  const int n = window_.dimension();
  const int clone = window_.cloneColumn(static_cast<int>(window_.clones.size()) - 1);
  const int nav = window_.navColumn();
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(15, n);
  Y.block<6, 6>(0, clone).setIdentity();
  Y.block<9, 9>(6, nav).setIdentity();
  solveRight(R_, Y);
  return Y * Y.transpose();
}

RelativeMotion SquareRootFilter::relativeMotion(int a, int b) const {
  const Clone &from = window_.clones[a], &to = window_.clones[b];
  RelativeMotion motion;
  motion.T_a_b = from.T_W_I.inverse() * to.T_W_I;
  // Jacobians at the first estimates, as for all rows of R, or the common position and yaw would not cancel.
  const Eigen::Matrix3d R_a_W = from.T_W_I_fej.R().transpose();
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(6, window_.dimension());
  Y.block<3, 3>(0, window_.cloneColumn(b)).setIdentity();
  Y.block<3, 3>(0, window_.cloneColumn(a)) -= to.T_W_I_fej.R().transpose() * from.T_W_I_fej.R();
  Y.block<3, 3>(3, window_.cloneColumn(a)) = hat(R_a_W * (to.T_W_I_fej.t() - from.T_W_I_fej.t()));
  Y.block<3, 3>(3, window_.cloneColumn(b) + 3) = R_a_W;
  Y.block<3, 3>(3, window_.cloneColumn(a) + 3) -= R_a_W;
  solveRight(R_, Y);
  motion.covariance = Y * Y.transpose();
  return motion;
}

Eigen::MatrixXd SquareRootFilter::covariance() const {
  Eigen::MatrixXd Y = Eigen::MatrixXd::Identity(R_.rows(), R_.cols());
  solveRight(R_, Y);
  return Y * Y.transpose();
}

bool SquareRootFilter::healthy() const {
  const auto diagonal = R_.diagonal().array();
  return diagonal.allFinite() && (diagonal > 0).all() && window_.isFinite();
}

}  // namespace vip_slam
