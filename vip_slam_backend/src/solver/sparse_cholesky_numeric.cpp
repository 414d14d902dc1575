// SPDX-License-Identifier: BSD-3-Clause
// Numeric part of the block-sparse Cholesky: assembly, partial factorisation of the fronts, substitution.
#include <algorithm>
#include <cstring>

#include "dense_kernels.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"
#include "worker.h"

namespace vip_slam {
namespace {

// Copies a block of the matrix into its front. The entries above the diagonal of a diagonal block are copied but never
// read.
template <int Rows>
void copyBlock(const double* source, int columns, double* target, int ld) {
  for (int j = 0; j < columns; ++j)
    std::memcpy(target + static_cast<std::size_t>(j) * ld, source + SparseCholesky::leading(Rows) * j,
                Rows * sizeof(double));
}

}  // namespace

bool SparseCholesky::factorizeFront(const Front& front, const double* values, const double* b) {
  const DenseKernels& kernels = denseKernels();
  const int n = front.rows, c = front.columns, ld = front.ld, m = front.updateRows(), ldu = front.updateLeading();
  // Pivot columns are assembled directly at their place in the factor.
  double* panel = factor_.data() + front.factor_offset;
  std::memset(panel, 0, sizeof(double) * ld * c);
  for (const Entry& e : front.entries) {
    const double* source = values + e.offset;
    double* target = panel + static_cast<std::size_t>(e.column) * ld + e.row;
    switch (e.rows) {
      case 6:
        copyBlock<6>(source, e.columns, target, ld);
        break;
      case 9:
        copyBlock<9>(source, e.columns, target, ld);
        break;
      default:
        copyBlock<3>(source, e.columns, target, ld);
    }
  }
  for (int k = 0; k < c; ++k) panel[static_cast<std::size_t>(k) * ld + n - 1] = b[front.unknowns[k]];
  for (const int child : front.children) {
    const Front& f = fronts_[child];
    kernels.extendAdd(panel, ld, updates_.data() + f.update_offset, f.updateLeading(), f.to_parent.data(),
                      static_cast<int>(f.to_parent.size()), 0, f.parent_pivots);
  }
  if (!kernels.factorPanel(panel, n, c, ld)) return false;
  if (m == 1) return true;
  double* update = updates_.data() + front.update_offset;
  kernels.negativeSyrk(update, ldu, panel + c, ld, m, m - 1, c);
  // Segments of update rows are indexed from the front's first row: shift the origin by the pivots.
  double* origin = update - static_cast<std::ptrdiff_t>(c) * ldu - c;
  for (const int child : front.children) {
    const Front& f = fronts_[child];
    kernels.extendAdd(origin, ldu, updates_.data() + f.update_offset, f.updateLeading(), f.to_parent.data(),
                      static_cast<int>(f.to_parent.size()), f.parent_pivots, f.updateRows() - 1);
  }
  return true;
}

bool SparseCholesky::factorize(const double* values, const double* b, Worker* worker) {
  bool good[3] = {true, true, true};
  const auto part = [&](int which) {
    for (const Front& front : fronts_)
      if (front.part == which && !(good[which] = factorizeFront(front, values, b))) return;
  };
  if (worker) {
    worker->share(2, part);
  } else {
    part(0);
    part(1);
  }
  if (!good[0] || !good[1]) return false;
  part(2);
  return good[2];
}

void SparseCholesky::backSubstitute(double* b) const {
  const DenseKernels& kernels = denseKernels();
  double* x = work_.data();
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const double* panel = factor_.data() + front.factor_offset;
    const int n = front.rows - 1, c = front.columns;
    for (int i = 0; i < c; ++i) x[i] = panel[static_cast<std::size_t>(i) * front.ld + n];
    for (int i = c; i < n; ++i) x[i] = b[front.unknowns[i]];
    kernels.backSubstitute(panel, n, c, front.ld, x);
    for (int i = 0; i < c; ++i) b[front.unknowns[i]] = x[i];
  }
}

bool SparseCholesky::solve(const double* values, double* b, Worker* worker) {
  if (!factorize(values, b, worker)) return false;
  backSubstitute(b);
  return true;
}

}  // namespace vip_slam
