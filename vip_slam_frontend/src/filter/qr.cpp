#include "vip_slam_frontend/filter/qr.h"

#include <cmath>
#include <limits>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VIP_SLAM_VECTOR_CLONES __attribute__((target_clones("arch=haswell", "default")))
#else
#define VIP_SLAM_VECTOR_CLONES
#endif

namespace vip_slam {

namespace {

// Four doubles, unaligned. Never crosses a function boundary, so the calling convention does not matter.
typedef double Pack __attribute__((vector_size(32), aligned(8), may_alias));

#define VIP_SLAM_INLINE inline __attribute__((always_inline))

VIP_SLAM_INLINE double dot(const double* a, const double* b, int n) {
  Pack s0 = {0, 0, 0, 0}, s1 = {0, 0, 0, 0};
  int i = 0;
  for (; i + 8 <= n; i += 8) {
    s0 += *reinterpret_cast<const Pack*>(a + i) * *reinterpret_cast<const Pack*>(b + i);
    s1 += *reinterpret_cast<const Pack*>(a + i + 4) * *reinterpret_cast<const Pack*>(b + i + 4);
  }
  s0 += s1;
  double sum = (s0[0] + s0[1]) + (s0[2] + s0[3]);
  for (; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

VIP_SLAM_INLINE void subtractScaled(double* a, const double* b, double scale, int n) {
  const Pack s = {scale, scale, scale, scale};
  int i = 0;
  for (; i + 4 <= n; i += 4) {
    *reinterpret_cast<Pack*>(a + i) -= s * *reinterpret_cast<const Pack*>(b + i);
  }
  for (; i < n; ++i) a[i] -= scale * b[i];
}

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

VIP_SLAM_VECTOR_CLONES
void triangulariseRaw(double* A, int rows, int cols, int pivots, double tolerance) {
  for (int j = 0; j < pivots && j < rows; ++j) {
    double* column = A + static_cast<long>(j) * rows;
    const int n = rows - j - 1;
    const double tau = makeReflector(column + j, column + j + 1, n, tolerance);
    if (tau != 0.0) {
      for (int c = j + 1; c < cols; ++c) {
        double* other = A + static_cast<long>(c) * rows;
        const double s = tau * (other[j] + dot(column + j + 1, other + j + 1, n));
        other[j] -= s;
        subtractScaled(other + j + 1, column + j + 1, s, n);
      }
      for (int i = 0; i < n; ++i) column[j + 1 + i] = 0.0;
    }
    if (column[j] < 0) {
      for (int c = j; c < cols; ++c) A[static_cast<long>(c) * rows + j] *= -1.0;
    }
  }
}

VIP_SLAM_VECTOR_CLONES
void stackRaw(double* R, double* r, int n, double* H, double* h, int m) {
  for (int j = 0; j < n; ++j) {
    double* column = H + static_cast<long>(j) * m;
    double* head = R + static_cast<long>(j) * n + j;
    const double tau = makeReflector(head, column, m, 0.0);
    if (tau == 0.0) continue;
    for (int c = j + 1; c < n; ++c) {
      double* other = H + static_cast<long>(c) * m;
      double* top = R + static_cast<long>(c) * n + j;
      const double s = tau * (*top + dot(column, other, m));
      *top -= s;
      subtractScaled(other, column, s, m);
    }
    const double s = tau * (r[j] + dot(column, h, m));
    r[j] -= s;
    subtractScaled(h, column, s, m);
  }
}

VIP_SLAM_VECTOR_CLONES
void solveRightRaw(const double* R, int n, double* H, int m) {
  for (int c = 0; c < n; ++c) {
    double* target = H + static_cast<long>(c) * m;
    const double* column = R + static_cast<long>(c) * n;
    for (int k = 0; k < c; ++k) {
      if (column[k] != 0.0) subtractScaled(target, H + static_cast<long>(k) * m, column[k], m);
    }
    const double inverse = 1.0 / column[c];
    for (int i = 0; i < m; ++i) target[i] *= inverse;
  }
}

}  // namespace

void triangularise(Eigen::MatrixXd& A, int pivots) {
  if (A.size() == 0) return;
  const double tolerance = std::numeric_limits<double>::epsilon() * A.cwiseAbs().maxCoeff();
  triangulariseRaw(A.data(), static_cast<int>(A.rows()), static_cast<int>(A.cols()), pivots, tolerance);
}

void stackTriangular(Eigen::MatrixXd& R, Eigen::VectorXd& r, Eigen::MatrixXd& H, Eigen::VectorXd& h) {
  stackRaw(R.data(), r.data(), static_cast<int>(R.rows()), H.data(), h.data(), static_cast<int>(H.rows()));
}

void solveRight(const Eigen::MatrixXd& R, Eigen::MatrixXd& H) {
  solveRightRaw(R.data(), static_cast<int>(R.rows()), H.data(), static_cast<int>(H.rows()));
}

}  // namespace vip_slam
