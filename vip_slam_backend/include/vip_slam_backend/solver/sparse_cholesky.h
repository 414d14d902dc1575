// SPDX-License-Identifier: BSD-3-Clause
// Block-sparse Cholesky of a symmetric positive definite matrix whose unknowns come in nodes (6 pose, 9 motion, 3
// plane): approximate minimum degree, then a multifrontal factorisation on dense fronts. The symbolic part is done once
// per structure; values are copied directly from the caller's blocks into the fronts. The right-hand side is the last
// row of every front, so that the forward substitution is part of the factorisation. Two disjoint parts of the
// elimination tree can be factorised in parallel, with bit-identical results.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "vip_slam_backend/solver/kernel_array.h"

namespace vip_slam {

class Worker;

/// Rows of a child's update that stay together in the parent's front.
struct FrontSegment {
  int child, parent, size;
};

class SparseCholesky {
 public:
  /// `sizes`: unknowns per node; `pairs`: distinct node pairs (a != b) that may be non-zero.
  void analyze(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& pairs);

  int nodes() const { return static_cast<int>(sizes_.size()); }
  int dimension() const { return dimension_; }
  /// Numbers in the factor, those that pad its fronts included.
  std::size_t factorSize() const { return factor_size_; }
  /// First unknown of a node in vectors (nodes in the caller's order).
  int unknown(int node) const { return unknown_[node]; }
  /// Place of a node in the elimination order.
  int position(int node) const { return position_[node]; }

  /// Values: column-major blocks in one array of valueCount() doubles. Diagonal blocks are square (lower half read);
  /// the block of pair k has the rows of the node eliminated later and the columns of the one eliminated earlier.
  /// Columns are leading(rows) apart: those of poses are padded so that a column is a whole number of vectors. Blocks
  /// begin at multiples of 8.
  static int leading(int rows) { return rows == 6 ? 8 : rows; }
  std::size_t valueCount() const { return value_count_; }
  std::size_t diagonalOffset(int node) const { return diagonal_offset_[node]; }
  std::size_t pairOffset(int pair) const { return pair_offset_[pair]; }

  /// Solves in place. False when the matrix is not positive definite. `worker` (may be null) helps with one half of the
  /// tree.
  bool solve(const double* values, double* b, Worker* worker = nullptr);

 private:
  struct Entry {         // a block of the matrix inside its front
    std::size_t offset;  // into values
    int row, column;     // inside the front
    int rows, columns;
  };
  struct Front {
    int columns = 0, rows = 0, ld = 0;  // pivots, pivots + update rows + right-hand side, leading dimension
    std::vector<Entry> entries;
    std::vector<int> children;
    std::vector<FrontSegment> to_parent;
    int parent_pivots = 0;      // number of update columns that are pivots of the parent
    std::vector<int> unknowns;  // caller's unknown of each row but the last
    std::size_t factor_offset = 0;
    std::size_t update_offset = 0;  // of the update matrix
    int updateRows() const { return rows - columns; }
    int updateLeading() const { return (updateRows() + 7) / 8 * 8; }
    int part = 2;  // 0 and 1: disjoint parts of the tree; 2: what lies above both
  };
  bool factorizeFront(const Front& front, const double* values, const double* b);
  bool factorize(const double* values, const double* b, Worker* worker);
  void backSubstitute(double* b) const;
  // sparse_cholesky_symbolic.cpp: the steps of analyze()
  struct Supernodes;
  /// Fixes the order of elimination; returns the structure of the factor below each node, in positions, ascending.
  std::vector<std::vector<int>> order(const std::vector<std::pair<int, int>>& pairs);
  Supernodes joinSupernodes(const std::vector<std::vector<int>>& structure) const;
  void layFronts(const std::vector<std::vector<int>>& structure, Supernodes* supernodes);
  void splitTree();
  void placeUpdates();
  void placeBlocks(const std::vector<std::pair<int, int>>& pairs, Supernodes* supernodes);
  int sizeAt(int position) const { return sizes_[node_at_[position]]; }

  std::vector<int> sizes_, unknown_, position_, node_at_;
  std::vector<std::size_t> diagonal_offset_, pair_offset_;
  std::size_t value_count_ = 0;
  int dimension_ = 0;
  std::vector<Front> fronts_;
  std::size_t factor_size_ = 0;
  KernelArray updates_, factor_;
  mutable std::vector<double> work_;
};

}  // namespace vip_slam
