// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/triangular_solve.h"

#include <cmath>

#include "packs.h"

namespace vip_slam {

namespace {

/// N columns c.. of H R^-1 for 4 P rows, all columns before c done.
template <int N, int P>
VIP_SLAM_INLINE void solveBlock(const double* R, int n, double* H, int m, int first, int c) {
  Pack sum[N][P];
  for (int j = 0; j < N; ++j) {
    for (int p = 0; p < P; ++p) sum[j][p] = load(H + static_cast<long>(c + j) * m + 4 * p);
  }
  for (int k = first; k < c; ++k) {
    Pack x[P];
    for (int p = 0; p < P; ++p) x[p] = load(H + static_cast<long>(k) * m + 4 * p);
    for (int j = 0; j < N; ++j) {
      const Pack factor = spread(R[static_cast<long>(c + j) * n + k]);
      for (int p = 0; p < P; ++p) sum[j][p] -= factor * x[p];
    }
  }
  for (int j = 0; j < N; ++j) {
    for (int p = 0; p < P; ++p) {
      Pack x = sum[j][p];
      for (int k = 0; k < j; ++k) x -= R[static_cast<long>(c + j) * n + c + k] * sum[k][p];
      sum[j][p] = x * (1.0 / R[static_cast<long>(c + j) * n + c + j]);
      store(H + static_cast<long>(c + j) * m + 4 * p, sum[j][p]);
    }
  }
}

template <int P>
VIP_SLAM_INLINE void solveRows(const double* R, int n, double* H, int m, int first) {
  int c = first;
  for (; c + 3 <= n; c += 3) solveBlock<3, P>(R, n, H, m, first, c);
  for (; c < n; ++c) solveBlock<1, P>(R, n, H, m, first, c);
}

/// Index of the first of the n columns in which any of the `count` rows is not zero.
VIP_SLAM_INLINE int firstFilled(const double* H, int n, int m, int count) {
  for (int c = 0; c < n; ++c) {
    for (int i = 0; i < count; ++i) {
      if (H[static_cast<long>(c) * m + i] != 0.0) return c;
    }
  }
  return n;
}

VIP_SLAM_VECTOR_CLONES
void solveRightRaw(const double* R, int n, double* H, int m) {
  int i = 0;
  for (; i + 12 <= m; i += 12) solveRows<3>(R, n, H + i, m, firstFilled(H + i, n, m, 12));
  for (; i < m; i += 4) solveRows<1>(R, n, H + i, m, firstFilled(H + i, n, m, 4));
}

/// Lower triangle of S = I + Z Z^T, by blocks of four rows and columns.
VIP_SLAM_VECTOR_CLONES
void innovationRaw(const double* Z, int n, int m, double* S) {
  for (int i = 0; i < m; i += 4) {
    const int first = firstFilled(Z + i, n, m, 4);
    for (int j = 0; j <= i; j += 4) {
      Pack sum[4] = {spread(0), spread(0), spread(0), spread(0)};
      for (int k = first; k < n; ++k) {
        const double* column = Z + static_cast<long>(k) * m;
        const Pack x = load(column + i);
        for (int l = 0; l < 4; ++l) sum[l] += spread(column[j + l]) * x;
      }
      for (int l = 0; l < 4; ++l) store(S + static_cast<long>(j + l) * m + i, sum[l]);
    }
  }
  for (int i = 0; i < m; ++i) S[static_cast<long>(i) * m + i] += 1.0;
}

/// S <- L with S = L L^T, r <- L^-1 r. The upper triangle stays as it is.
VIP_SLAM_VECTOR_CLONES
void choleskyRaw(double* S, int m, double* r) {
  for (int j = 0; j < m; ++j) {
    double* column = S + static_cast<long>(j) * m;
    const double inverse = 1.0 / std::sqrt(column[j]);
    for (int i = j; i < m; ++i) column[i] *= inverse;
    r[j] *= inverse;
    subtractScaled(r + j + 1, column + j + 1, r[j], m - j - 1);
    for (int k = j + 1; k < m; ++k) {
      subtractScaled(S + static_cast<long>(k) * m + k, column + k, column[k], m - k);
    }
  }
}

/// |L^-1|^2, the trace of S^-1; and |L^-T r|^2. `work` has m entries.
VIP_SLAM_VECTOR_CLONES
double inverseTraceRaw(const double* L, int m, double* r, double* work, double* norm2) {
  for (int j = m - 1; j >= 0; --j) {
    const double* column = L + static_cast<long>(j) * m;
    r[j] = (r[j] - dot(column + j + 1, r + j + 1, m - j - 1)) / column[j];
  }
  *norm2 = dot(r, r, m);
  double trace = 0;
  for (int c = 0; c < m; ++c) {
    for (int i = c; i < m; ++i) work[i] = 0;
    work[c] = 1;
    for (int j = c; j < m; ++j) {
      const double* column = L + static_cast<long>(j) * m;
      const double x = work[j] / column[j];
      trace += x * x;
      subtractScaled(work + j + 1, column + j + 1, x, m - j - 1);
    }
  }
  return trace;
}

int padded(long rows) { return static_cast<int>((rows + 3) / 4 * 4); }

}  // namespace

void solveRight(const Eigen::MatrixXd& R, Eigen::MatrixXd& H) {
  const long rows = H.rows();
  H.conservativeResize(padded(rows), Eigen::NoChange);
  H.bottomRows(H.rows() - rows).setZero();
  solveRightRaw(R.data(), static_cast<int>(R.rows()), H.data(), static_cast<int>(H.rows()));
  H.conservativeResize(rows, Eigen::NoChange);
}

Innovation testInnovation(const Eigen::MatrixXd& R, const Eigen::MatrixXd& H, const Eigen::VectorXd& r) {
  const int n = static_cast<int>(R.rows()), m = padded(H.rows());
  Eigen::MatrixXd Z(m, n), S(m, m);
  Z.topRows(H.rows()) = H;
  Z.bottomRows(m - H.rows()).setZero();
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(m), work(m);
  residual.head(r.size()) = r;
  solveRightRaw(R.data(), n, Z.data(), m);
  innovationRaw(Z.data(), n, m, S.data());
  choleskyRaw(S.data(), m, residual.data());
  Innovation result;
  result.distance = residual.squaredNorm();
  double norm2 = 0;
  result.expected_pull = m - inverseTraceRaw(S.data(), m, residual.data(), work.data(), &norm2);
  // P H^T S^-1 r, whitened by P, is Z^T S^-1 r; and Z Z^T = S - I.
  result.pull = result.distance - norm2;
  return result;
}

}  // namespace vip_slam
