// SPDX-License-Identifier: BSD-3-Clause
// Dense kernels of the multifrontal Cholesky on plain arrays, column-major.
#pragma once

#include "instruction_set.h"
#include "kernel_lanes.h"

namespace vip_slam {

struct FrontSegment;

/// kKernelLanes rows must be readable (and zero) below the last one of every panel given to the kernels.
struct DenseKernels {
  /// Cholesky of the leading c x c block of the n x n lower matrix A (leading dimension ld), rows below become L21.
  /// False when a pivot is not positive. The entries above the diagonal are overwritten.
  bool (*factorPanel)(double* A, int n, int c, int ld);
  /// Lower part of the first `columns` columns of C (m rows; leading dimension ldc, a multiple of 8) = -P P^T with P
  /// m x k (leading dimension ldp). The entries above the diagonal and below row m are overwritten.
  void (*negativeSyrk)(double* C, int ldc, const double* P, int ldp, int m, int columns, int k);
  /// Solves L11^T x1 = x1 - L21^T x2 with the panel's first c columns.
  void (*backSubstitute)(const double* A, int n, int c, int ld, double* x);
  /// Adds columns [begin, end) of a child's lower update matrix (leading dimension ldu) to its parent's: rows and
  /// columns of a segment's child range are added to those of its parent range. `target`: the parent's row and column
  /// 0. The entries above the diagonal are overwritten.
  void (*extendAdd)(double* target, int ld, const double* update, int ldu, const FrontSegment* segments, int count,
                    int begin, int end);
};

/// The fastest build that this processor supports.
const DenseKernels& denseKernels();
/// For tests: one build, which this processor must support.
const DenseKernels& denseKernels(InstructionSet set);

}  // namespace vip_slam
