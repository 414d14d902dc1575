// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/qr.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "packs.h"

namespace vip_slam {

namespace {

// Reflectors that are applied together (compact WY form): a trailing column is then read twice per kPanel pivots.
constexpr int kPanel = 4;

/// Reflector of (head; tail): head becomes beta >= 0, tail is scaled to v (v_0 = 1). Returns tau; 0: nothing to do.
VIP_SLAM_INLINE double makeReflector(double* head, double* tail, int n, double tolerance) {
  const double tail2 = dot(tail, tail, n);
  const double alpha = *head;
  if (tail2 <= tolerance * tolerance) {
    for (int i = 0; i < n; ++i) tail[i] = 0.0;
    return 0.0;
  }
  const double beta = std::sqrt(alpha * alpha + tail2);
  // (alpha - beta) without cancellation, so that the result is +beta.
  const double v0 = alpha <= 0 ? alpha - beta : -tail2 / (alpha + beta);
  const double inverse = 1.0 / v0;
  for (int i = 0; i < n; ++i) tail[i] *= inverse;
  *head = beta;
  return 2.0 * v0 * v0 / (tail2 + v0 * v0);
}

/// kPanel reflectors as one: Q^T = I - V T^T V^T. V (m x kPanel, columns `m` apart); unused columns are zero.
struct Panel {
  const double* V;
  int m;
  double T[kPanel][kPanel];
};

/// T from the reflectors' tau, `V` set already.
VIP_SLAM_INLINE void combine(Panel* panel, const double* tau, int width) {
  for (int i = 0; i < kPanel; ++i) {
    for (int k = 0; k < kPanel; ++k) panel->T[i][k] = 0;
  }
  for (int i = 0; i < width; ++i) {
    double overlap[kPanel];
    const double* v = panel->V + static_cast<long>(i) * panel->m;
    for (int k = 0; k < i; ++k) overlap[k] = dot(panel->V + static_cast<long>(k) * panel->m, v, panel->m);
    for (int k = 0; k < i; ++k) {
      double sum = 0;
      for (int l = k; l < i; ++l) sum += panel->T[k][l] * overlap[l];
      panel->T[k][i] = -tau[i] * sum;
    }
    panel->T[i][i] = tau[i];
  }
}

/// s <- T^T s
VIP_SLAM_INLINE void timesTransposedT(const Panel& panel, double* s) {
  for (int i = kPanel - 1; i >= 0; --i) {
    double sum = 0;
    for (int k = 0; k <= i; ++k) sum += panel.T[k][i] * s[k];
    s[i] = sum;
  }
}

/// Applies the panel's reflectors to N columns of the matrix. `top`: the `width` entries above each column on which V
/// acts as the identity; `width` 0: none.
template <int N>
VIP_SLAM_INLINE void applyPanel(const Panel& panel, double* const* columns, double* const* top, int width) {
  const int m = panel.m, whole = m - m % 4;
  const double *v0 = panel.V, *v1 = v0 + m, *v2 = v1 + m, *v3 = v2 + m;
  Pack sum[N][kPanel];
  for (int c = 0; c < N; ++c) sum[c][0] = sum[c][1] = sum[c][2] = sum[c][3] = spread(0);
  for (int i = 0; i < whole; i += 4) {
    const Pack w0 = load(v0 + i), w1 = load(v1 + i), w2 = load(v2 + i), w3 = load(v3 + i);
    for (int c = 0; c < N; ++c) {
      const Pack x = load(columns[c] + i);
      sum[c][0] += w0 * x;
      sum[c][1] += w1 * x;
      sum[c][2] += w2 * x;
      sum[c][3] += w3 * x;
    }
  }
  double s[N][kPanel];
  for (int c = 0; c < N; ++c) {
    for (int l = 0; l < kPanel; ++l) {
      s[c][l] = total(sum[c][l]);
      for (int i = whole; i < m; ++i) s[c][l] += panel.V[static_cast<long>(l) * m + i] * columns[c][i];
      if (l < width) s[c][l] += top[c][l];
    }
    timesTransposedT(panel, s[c]);
    for (int l = 0; l < width; ++l) top[c][l] -= s[c][l];
  }
  for (int i = 0; i < whole; i += 4) {
    const Pack w0 = load(v0 + i), w1 = load(v1 + i), w2 = load(v2 + i), w3 = load(v3 + i);
    for (int c = 0; c < N; ++c) {
      const Pack step = (s[c][0] * w0 + s[c][1] * w1) + (s[c][2] * w2 + s[c][3] * w3);
      store(columns[c] + i, load(columns[c] + i) - step);
    }
  }
  for (int i = whole; i < m; ++i) {
    for (int c = 0; c < N; ++c) {
      columns[c][i] -= (s[c][0] * v0[i] + s[c][1] * v1[i]) + (s[c][2] * v2[i] + s[c][3] * v3[i]);
    }
  }
}

VIP_SLAM_VECTOR_CLONES
void triangulariseRaw(double* A, int rows, int cols, int pivots, double tolerance, double* V) {
  pivots = std::min(pivots, rows);
  for (int j = 0; j < pivots; j += kPanel) {
    const int width = std::min(kPanel, pivots - j), m = rows - j;
    double tau[kPanel] = {0, 0, 0, 0};
    for (int i = 0; i < width; ++i) {
      double* column = A + static_cast<long>(j + i) * rows + j + i;
      const int n = m - i - 1;
      tau[i] = makeReflector(column, column + 1, n, tolerance);
      for (int k = i + 1; k < width && tau[i] != 0.0; ++k) {
        double* other = A + static_cast<long>(j + k) * rows + j + i;
        const double s = tau[i] * (other[0] + dot(column + 1, other + 1, n));
        other[0] -= s;
        subtractScaled(other + 1, column + 1, s, n);
      }
      // Moves the reflector to V, with its leading one and the zeros above; A becomes zero below the diagonal.
      double* v = V + static_cast<long>(i) * m;
      for (int k = 0; k < i; ++k) v[k] = 0;
      v[i] = 1;
      for (int k = 0; k < n; ++k) {
        v[i + 1 + k] = column[1 + k];
        column[1 + k] = 0;
      }
    }
    for (long i = static_cast<long>(width) * m; i < static_cast<long>(kPanel) * m; ++i) V[i] = 0;
    Panel panel{V, m, {}};
    combine(&panel, tau, width);
    int c = j + width;
    for (; c + 2 <= cols; c += 2) {
      double* const columns[] = {A + static_cast<long>(c) * rows + j, A + static_cast<long>(c + 1) * rows + j};
      applyPanel<2>(panel, columns, nullptr, 0);
    }
    for (; c < cols; ++c) {
      double* const columns[] = {A + static_cast<long>(c) * rows + j};
      applyPanel<1>(panel, columns, nullptr, 0);
    }
    for (int i = j; i < j + width; ++i) {
      if (A[static_cast<long>(i) * rows + i] >= 0) continue;
      for (int k = i; k < cols; ++k) A[static_cast<long>(k) * rows + i] *= -1.0;
    }
  }
}

VIP_SLAM_VECTOR_CLONES
void stackRaw(double* R, double* r, int n, double* H, double* h, int rows, const int* filled, double* V) {
  for (int j = 0; j < n; j += kPanel) {
    const int width = std::min(kPanel, n - j), m = filled[j + width - 1];
    if (m == 0) continue;
    double tau[kPanel] = {0, 0, 0, 0};
    for (int i = 0; i < width; ++i) {
      double* column = H + static_cast<long>(j + i) * rows;
      const long diagonal = static_cast<long>(j + i) * n + j + i;
      tau[i] = makeReflector(R + diagonal, column, m, 0.0);
      for (int k = i + 1; k < width && tau[i] != 0.0; ++k) {
        double* other = H + static_cast<long>(j + k) * rows;
        double* top = R + diagonal + static_cast<long>(k - i) * n;
        const double s = tau[i] * (*top + dot(column, other, m));
        *top -= s;
        subtractScaled(other, column, s, m);
      }
      double* v = V + static_cast<long>(i) * m;
      for (int k = 0; k < m; ++k) v[k] = column[k];
    }
    for (long i = static_cast<long>(width) * m; i < static_cast<long>(kPanel) * m; ++i) V[i] = 0;
    Panel panel{V, m, {}};
    combine(&panel, tau, width);
    int c = j + width;
    for (; c + 2 <= n; c += 2) {
      double* const columns[] = {H + static_cast<long>(c) * rows, H + static_cast<long>(c + 1) * rows};
      double* const top[] = {R + static_cast<long>(c) * n + j, R + static_cast<long>(c + 1) * n + j};
      applyPanel<2>(panel, columns, top, width);
    }
    for (; c < n; ++c) {
      double* const columns[] = {H + static_cast<long>(c) * rows};
      double* const top[] = {R + static_cast<long>(c) * n + j};
      applyPanel<1>(panel, columns, top, width);
    }
    double* const columns[] = {h};
    double* const top[] = {r + j};
    applyPanel<1>(panel, columns, top, width);
  }
}

}  // namespace

void triangularise(Eigen::MatrixXd& A, int pivots) {
  if (A.size() == 0) return;
  const double tolerance = std::numeric_limits<double>::epsilon() * A.cwiseAbs().maxCoeff();
  std::vector<double> V(kPanel * A.rows());
  triangulariseRaw(A.data(), static_cast<int>(A.rows()), static_cast<int>(A.cols()), pivots, tolerance, V.data());
}

void stackTriangular(Eigen::MatrixXd& R, Eigen::VectorXd& r, Eigen::MatrixXd& H, Eigen::VectorXd& h) {
  const int n = static_cast<int>(R.rows()), rows = static_cast<int>(H.rows());
  // Eliminating a column fills only the rows down to the last non-zero one of the columns so far; skip those below.
  std::vector<int> filled(n);
  int last = 0;
  for (int c = 0; c < n; ++c) {
    int i = rows;
    while (i > last && H(i - 1, c) == 0.0) --i;
    filled[c] = last = i;
  }
  std::vector<double> V(kPanel * rows);
  stackRaw(R.data(), r.data(), n, H.data(), h.data(), rows, filled.data(), V.data());
}

}  // namespace vip_slam
