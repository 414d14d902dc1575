// Numeric part of the block-sparse Cholesky: assembly, partial factorisation of the fronts, substitution.
#include <algorithm>
#include <cstring>

#include "dense_kernels.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {

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

bool SparseCholesky::factorize(const double* values) {
  const DenseKernels& kernels = denseKernels();
  std::size_t stack = 0;
  for (const Front& front : fronts_) {
    const int n = front.rows, c = front.columns, ld = front.ld, m = n - c;
    // Pivot columns are assembled where the factor stays.
    double* panel = factor_.data() + front.factor_offset;
    std::memset(panel, 0, sizeof(double) * ld * c);
    for (const Entry& e : front.entries) {
      const double* source = values + e.offset;
      for (int j = 0; j < e.columns; ++j) {
        double* target = panel + static_cast<std::size_t>(e.column + j) * ld + e.row;
        for (int i = e.diagonal ? j : 0; i < e.rows; ++i) target[i] = source[i];
        source += e.ld;
      }
    }
    const std::size_t top = stack;
    const auto eachChild = [&](bool pivots, double* target, int target_ld) {
      std::size_t at = top;
      for (auto child = front.children.rbegin(); child != front.children.rend(); ++child) {
        const Front& from = fronts_[*child];
        const std::size_t k = from.rows - from.columns;
        at -= k * k;
        addChild(from, stack_.data() + at, c, pivots, target, target_ld);
      }
      return at;
    };
    stack = eachChild(true, panel, ld);
    if (!kernels.factorPanel(panel, n, c, ld)) return false;
    if (m > 0) {
      // The update matrix is made above the children's and takes their place when it has taken them up.
      double* update = stack_.data() + top;
      kernels.negativeSyrk(update, m, panel + c, ld, m, c);
      eachChild(false, update, m);
      if (top != stack) {
        double* to = stack_.data() + stack;
        for (std::size_t j = 0; j < static_cast<std::size_t>(m); ++j)
          std::memmove(to + j * m + j, update + j * m + j, sizeof(double) * (m - j));
      }
      stack += static_cast<std::size_t>(m) * m;
    }
  }
  return true;
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
