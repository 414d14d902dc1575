// Numeric part of the block-sparse Cholesky: assembly, partial factorisation of the fronts, substitution.
#include <algorithm>
#include <cstring>

#include "dense_kernels.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {

bool SparseCholesky::factorize(const double* values) {
  const DenseKernels& kernels = denseKernels();
  std::size_t stack = 0;
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    const int n = front.rows, c = front.columns, ld = front.ld, m = n - c;
    // Pivot columns are assembled where the factor stays; the rest in the scratch front.
    double* panel = factor_.data() + front.factor_offset;
    double* rest = front_.data();
    std::memset(panel, 0, sizeof(double) * ld * c);
    for (int j = 0; j < m; ++j) std::memset(rest + static_cast<std::size_t>(j) * m + j, 0, sizeof(double) * (m - j));
    for (const Entry& e : front.entries) {
      const double* source = values + e.offset;
      for (int j = 0; j < e.columns; ++j) {
        double* target = panel + static_cast<std::size_t>(e.column + j) * ld + e.row;
        for (int i = e.diagonal ? j : 0; i < e.rows; ++i) target[i] = source[i];
        source += e.ld;
      }
    }
    for (auto child = front.children.rbegin(); child != front.children.rend(); ++child) {
      const Front& from = fronts_[*child];
      const int k = from.rows - from.columns;
      stack -= static_cast<std::size_t>(k) * k;
      const double* update = stack_.data() + stack;
      for (std::size_t sj = 0; sj < from.to_parent.size(); ++sj) {
        const Segment& cs = from.to_parent[sj];
        for (int j = 0; j < cs.size; ++j) {
          const double* source = update + static_cast<std::size_t>(cs.child + j) * k;
          const int column = cs.parent + j;
          double* target = column < c ? panel + static_cast<std::size_t>(column) * ld
                                      : rest + static_cast<std::size_t>(column - c) * m - c;
          for (int i = j; i < cs.size; ++i) target[cs.parent + i] += source[cs.child + i];
          for (std::size_t si = sj + 1; si < from.to_parent.size(); ++si) {
            const Segment& rs = from.to_parent[si];
            double* t = target + rs.parent;
            const double* s = source + rs.child;
            for (int i = 0; i < rs.size; ++i) t[i] += s[i];
          }
        }
      }
    }
    if (!kernels.factorPanel(panel, n, c, ld)) return false;
    if (m > 0) {
      double* update = stack_.data() + stack;
      for (int j = 0; j < m; ++j)
        std::memcpy(update + static_cast<std::size_t>(j) * m + j, rest + static_cast<std::size_t>(j) * m + j,
                    sizeof(double) * (m - j));
      kernels.subtractSyrk(update, m, panel + c, ld, m, c);
      stack += static_cast<std::size_t>(m) * m;
    }
  }
  return true;
}

void SparseCholesky::solve(double* b) const {
  double* x = work_.data();
  for (const Front& front : fronts_) {
    const int n = front.rows, c = front.columns, ld = front.ld;
    const double* panel = factor_.data() + front.factor_offset;
    for (int i = 0; i < c; ++i) x[i] = b[front.unknowns[i]];
    for (int i = c; i < n; ++i) x[i] = 0;
    for (int j = 0; j < c; ++j) {
      const double* column = panel + static_cast<std::size_t>(j) * ld;
      const double v = x[j] / column[j];
      x[j] = v;
      for (int i = j + 1; i < n; ++i) x[i] -= v * column[i];
    }
    for (int i = 0; i < c; ++i) b[front.unknowns[i]] = x[i];
    for (int i = c; i < n; ++i) b[front.unknowns[i]] += x[i];
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const int n = front.rows, c = front.columns, ld = front.ld;
    const double* panel = factor_.data() + front.factor_offset;
    for (int i = 0; i < n; ++i) x[i] = b[front.unknowns[i]];
    for (int j = c - 1; j >= 0; --j) {
      const double* column = panel + static_cast<std::size_t>(j) * ld;
      double v = x[j];
      for (int i = j + 1; i < n; ++i) v -= column[i] * x[i];
      x[j] = v / column[j];
      b[front.unknowns[j]] = x[j];
    }
  }
}

}  // namespace vip_slam
