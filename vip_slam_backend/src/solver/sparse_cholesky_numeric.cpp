// Numeric part of the block-sparse Cholesky: assembly, partial factorisation of the fronts, substitution.
#include <algorithm>
#include <cstring>

#include "dense_kernels.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"
#include "worker.h"

namespace vip_slam {
namespace {

// A block of the matrix into its front. What stands above the diagonal of a diagonal block goes along and is never
// read.
template <int Rows>
void copyBlock(const double* source, int columns, double* target, int ld) {
  for (int j = 0; j < columns; ++j)
    std::memcpy(target + static_cast<std::size_t>(j) * ld, source + SparseCholesky::leading(Rows) * j,
                Rows * sizeof(double));
}

}  // namespace

// Adds a child's update to its parent: the columns that are pivots there (`pivots`), or the others.
void SparseCholesky::addChild(const Front& child, const double* update, int parent_columns, bool pivots, double* target,
                              int ld) {
  const int k = child.rows - child.columns;
  for (std::size_t sj = 0; sj < child.to_parent.size(); ++sj) {
    const Segment& cs = child.to_parent[sj];
    for (int j = 0; j < cs.size; ++j) {
      const int column = cs.parent + j;
      if ((column < parent_columns) != pivots) continue;
      const double* source = update + static_cast<std::size_t>(cs.child + j) * k;
      // Rows of the other columns are counted from the parent's first update row.
      double* to = pivots ? target + static_cast<std::size_t>(column) * ld
                          : target + static_cast<std::size_t>(column - parent_columns) * ld - parent_columns;
      for (int i = j; i < cs.size; ++i) to[cs.parent + i] += source[cs.child + i];
      for (std::size_t si = sj + 1; si < child.to_parent.size(); ++si) {
        const Segment& rs = child.to_parent[si];
        double* t = to + rs.parent;
        const double* s = source + rs.child;
        for (int i = 0; i < rs.size; ++i) t[i] += s[i];
      }
    }
  }
}

bool SparseCholesky::factorizeFront(const Front& front, const double* values) {
  const DenseKernels& kernels = denseKernels();
  const int n = front.rows, c = front.columns, ld = front.ld, m = n - c;
  // Pivot columns are assembled where the factor stays.
  double* panel = factor_.data() + front.factor_offset;
  std::memset(panel, 0, sizeof(double) * ld * c);
  for (const Entry& e : front.entries) {
    const double* source = values + e.offset;
    double* target = panel + static_cast<std::size_t>(e.column) * ld + e.row;
    switch (e.rows) {
      case 6: copyBlock<6>(source, e.columns, target, ld); break;
      case 9: copyBlock<9>(source, e.columns, target, ld); break;
      default: copyBlock<3>(source, e.columns, target, ld);
    }
  }
  const auto addChildren = [&](bool pivots, double* target, int target_ld) {
    for (const int child : front.children)
      addChild(fronts_[child], updates_.data() + fronts_[child].update_offset, c, pivots, target, target_ld);
  };
  addChildren(true, panel, ld);
  if (!kernels.factorPanel(panel, n, c, ld)) return false;
  if (m == 0) return true;
  double* update = updates_.data() + front.update_offset;
  kernels.negativeSyrk(update, m, panel + c, ld, m, c);
  addChildren(false, update, m);
  return true;
}

bool SparseCholesky::factorize(const double* values, Worker* worker) {
  bool good[3] = {true, true, true};
  const auto part = [&](int which) {
    for (const Front& front : fronts_)
      if (front.part == which && !(good[which] = factorizeFront(front, values))) return;
  };
  if (worker) {
    worker->both([&] { part(0); }, [&] { part(1); });
  } else {
    part(0);
    part(1);
  }
  if (!good[0] || !good[1]) return false;
  part(2);
  return good[2];
}

void SparseCholesky::solve(double* b) const {
  const DenseKernels& kernels = denseKernels();
  double* x = work_.data();
  for (const Front& front : fronts_) {
    const int n = front.rows, c = front.columns;
    for (int i = 0; i < c; ++i) x[i] = b[front.unknowns[i]];
    for (int i = c; i < n; ++i) x[i] = 0;
    kernels.forwardSubstitute(factor_.data() + front.factor_offset, n, c, front.ld, x);
    for (int i = 0; i < c; ++i) b[front.unknowns[i]] = x[i];
    for (int i = c; i < n; ++i) b[front.unknowns[i]] += x[i];
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    for (int i = 0; i < front.rows; ++i) x[i] = b[front.unknowns[i]];
    kernels.backSubstitute(factor_.data() + front.factor_offset, front.rows, front.columns, front.ld, x);
    for (int i = 0; i < front.columns; ++i) b[front.unknowns[i]] = x[i];
  }
}

}  // namespace vip_slam
