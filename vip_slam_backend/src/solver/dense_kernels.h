// Dense kernels of the multifrontal Cholesky on plain arrays, column-major. One of three builds (AVX-512, AVX2,
// baseline) is chosen at run time; nothing but plain pointers crosses, so no Eigen object meets another alignment.
#pragma once

namespace vip_slam {

/// Rows that must be readable (and zero) below the last one of every matrix given to the kernels.
constexpr int kKernelPadding = 16;

struct DenseKernels {
  const char* name;
  /// Cholesky of the leading c x c block of the n x n lower matrix A (leading dimension ld), rows below become L21.
  /// False when a pivot is not positive.
  bool (*factorPanel)(double* A, int n, int c, int ld);
  /// Lower part of C (m x m, leading dimension ldc) = -P P^T with P m x k (leading dimension ldp).
  void (*negativeSyrk)(double* C, int ldc, const double* P, int ldp, int m, int k);
  /// Solves with the panel's first c columns: L11 x1 = x1, x2 -= L21 x1; and back, x1 from x2.
  void (*forwardSubstitute)(const double* A, int n, int c, int ld, double* x);
  void (*backSubstitute)(const double* A, int n, int c, int ld, double* x);
};

/// The fastest build that this processor runs.
const DenseKernels& denseKernels();
/// By name ("avx512", "avx2", "baseline"); null when this processor does not run it.
const DenseKernels* denseKernelsByName(const char* name);

}  // namespace vip_slam
