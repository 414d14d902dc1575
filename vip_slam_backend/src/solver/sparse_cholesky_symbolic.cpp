// SPDX-License-Identifier: BSD-3-Clause
// Symbolic part of the block-sparse Cholesky: fronts, their memory offsets and their parts.
#include <algorithm>
#include <limits>
#include <numeric>

#include "dense_kernels.h"
#include "elimination_tree.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {
namespace {

// Size of a block in doubles, rounded up to whole cache lines.
std::size_t blockValues(int rows, int columns) {
  return (static_cast<std::size_t>(SparseCholesky::leading(rows)) * columns + 7) / 8 * 8;
}

}  // namespace

// Splits the tree into two parts of about equal cost: from the roots down, the most expensive subtree is opened (its
// root is left for the serial rest) as long as that shortens the critical path.
void SparseCholesky::splitTree() {
  const int n = static_cast<int>(fronts_.size());
  std::vector<double> cost(n, 0);  // of the whole subtree
  std::vector<int> parent(n, -1);
  for (int f = 0; f < n; ++f) {
    for (int c = 0; c < fronts_[f].columns; ++c) cost[f] += double(fronts_[f].rows - c) * (fronts_[f].rows - c);
    for (const int child : fronts_[f].children) {
      cost[f] += cost[child];
      parent[child] = f;
    }
  }
  std::vector<std::pair<double, int>> open;  // subtrees, ascending by cost
  for (int f = 0; f < n; ++f)
    if (parent[f] < 0) open.emplace_back(cost[f], f);
  double above = 0, best = std::numeric_limits<double>::infinity();
  std::vector<int> best_part(n, 2);
  while (!open.empty() && above < best) {
    std::sort(open.begin(), open.end());
    double sum[2] = {0, 0};
    std::vector<int> part(n, 2);
    for (auto it = open.rbegin(); it != open.rend(); ++it) {
      const int lighter = sum[1] < sum[0];
      sum[lighter] += it->first;
      part[it->second] = lighter;
    }
    const double way = above + std::max(sum[0], sum[1]);
    if (way < best) {
      best = way;
      best_part = part;
    }
    const int dearest = open.back().second;
    open.pop_back();
    above += cost[dearest];
    for (const int child : fronts_[dearest].children) {
      above -= cost[child];
      open.emplace_back(cost[child], child);
    }
  }
  for (int f = n - 1; f >= 0; --f)  // parents come after their children
    fronts_[f].part = parent[f] >= 0 && best_part[parent[f]] < 2 ? best_part[f] = best_part[parent[f]] : best_part[f];
}

// Memory offsets of the update matrices: an update lives until its parent has been assembled; its memory is then reused
// within its part. The first gap that is large enough is used.
void SparseCholesky::placeUpdates() {
  struct Live {
    std::size_t begin, end;
    int front;
  };
  std::size_t base = 0;
  for (int part = 0; part < 3; ++part) {
    std::vector<Live> live;  // ascending
    std::size_t top = base;
    for (int f = 0; f < static_cast<int>(fronts_.size()); ++f) {
      Front& front = fronts_[f];
      if (front.part != part) continue;
      const std::size_t m = front.updateRows() - 1, size = m * front.updateLeading();
      std::size_t at = base;
      auto before = live.begin();
      for (; before != live.end() && before->begin < at + size; ++before) at = before->end;
      if (size > 0) live.insert(before, {at, at + size, f});
      front.update_offset = at;
      top = std::max(top, at + size);
      const auto taken = [&](const Live& l) {
        return std::find(front.children.begin(), front.children.end(), l.front) != front.children.end();
      };
      live.erase(std::remove_if(live.begin(), live.end(), taken), live.end());
    }
    base = top;
  }
  updates_.resize(base + kKernelLanes);
}

/// Supernodes: consecutive nodes of the elimination that are factorised as one front. Indexed by front:
struct SparseCholesky::Supernodes {
  std::vector<int> first, last;      // positions
  Lists rows, row_offset;            // positions of its rows, and where each begins in the front
  std::vector<int> of;               // front of each position
  std::vector<int> offset_in_front;  // of each position, in the front of the last enter(); work space
  void enter(int front) {
    for (std::size_t k = 0; k < rows[front].size(); ++k) offset_in_front[rows[front][k]] = row_offset[front][k];
  }
};

Lists SparseCholesky::order(const std::vector<std::pair<int, int>>& pairs) {
  const int n = nodes();
  Lists neighbours(n);
  std::vector<int> degree(n, 0);
  for (const auto& pair : pairs) ++degree[pair.first], ++degree[pair.second];
  for (int v = 0; v < n; ++v) neighbours[v].reserve(degree[v]);
  for (const auto& pair : pairs) {
    neighbours[pair.first].push_back(pair.second);
    neighbours[pair.second].push_back(pair.first);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  position_ = minimumDegree(sizes_, neighbours);
  std::vector<int> parent;
  Lists eliminated = eliminate(neighbours, position_, &parent);
  const std::vector<int> post = postorder(parent);
  std::vector<int> renumber(n);
  for (int k = 0; k < n; ++k) renumber[post[k]] = k;
  for (int v = 0; v < n; ++v) position_[v] = renumber[position_[v]];
  node_at_.resize(n);
  for (int v = 0; v < n; ++v) node_at_[position_[v]] = v;
  Lists structure(n);  // the same elimination, renumbered
  for (int k = 0; k < n; ++k) {
    for (int& p : eliminated[k]) p = renumber[p];
    std::sort(eliminated[k].begin(), eliminated[k].end());
    structure[renumber[k]] = std::move(eliminated[k]);
  }
  return structure;
}

// Nodes of a chain in the elimination tree are joined while this stores few additional zeros: the narrower a front, the
// more zeros its overhead justifies (measured limits, docs/bundle_adjustment.md).
SparseCholesky::Supernodes SparseCholesky::joinSupernodes(const Lists& structure) const {
  const int n = nodes();
  Supernodes supernodes;
  supernodes.of.resize(n);
  supernodes.offset_in_front.assign(n, -1);
  const auto parent = [&](int k) { return structure[k].empty() ? -1 : structure[k].front(); };
  for (int k = 0; k < n;) {
    int end = k, columns = sizeAt(k);
    double zeros = 0;
    while (end + 1 < n && parent(end) == end + 1) {
      double missing = 0;  // rows of the parent that the present front lacks
      std::size_t i = 0;
      for (const int p : structure[end + 1]) {
        while (i < structure[end].size() && structure[end][i] < p) ++i;
        if (i == structure[end].size() || structure[end][i] != p) missing += sizeAt(p);
      }
      double below = 0;
      for (const int p : structure[end + 1]) below += sizeAt(p);
      const double joined_columns = columns + sizeAt(end + 1);
      const double total = joined_columns * (below + 0.5 * joined_columns);
      const double joined_zeros = zeros + columns * missing;
      const double limit = joined_columns <= 20 ? 0.4 : joined_columns <= 48 ? 0.15 : 0.05;
      if (joined_zeros > limit * total) break;
      zeros = joined_zeros;
      columns = static_cast<int>(joined_columns);
      ++end;
    }
    for (int p = k; p <= end; ++p) supernodes.of[p] = static_cast<int>(supernodes.first.size());
    supernodes.first.push_back(k);
    supernodes.last.push_back(end);
    k = end + 1;
  }
  return supernodes;
}

void SparseCholesky::layFronts(const Lists& structure, Supernodes* supernodes) {
  fronts_.assign(supernodes->first.size(), Front());
  supernodes->rows.resize(fronts_.size());
  supernodes->row_offset.resize(fronts_.size());
  factor_size_ = 0;
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    const int last = supernodes->last[f];
    std::vector<int>& rows = supernodes->rows[f];
    for (int p = supernodes->first[f]; p <= last; ++p) rows.push_back(p);
    rows.insert(rows.end(), structure[last].begin(), structure[last].end());
    for (const int p : rows) {
      supernodes->row_offset[f].push_back(front.rows);
      for (int u = 0; u < sizeAt(p); ++u) front.unknowns.push_back(unknown_[node_at_[p]] + u);
      front.rows += sizeAt(p);
      if (p <= last) front.columns += sizeAt(p);
    }
    ++front.rows;  // the right-hand side
    front.ld = (front.rows + kKernelLanes + 7) / 8 * 8;
    if (front.ld % 64 == 0) front.ld += 8;  // so that columns do not map to the same cache sets
    front.factor_offset = factor_size_;
    factor_size_ += static_cast<std::size_t>(front.ld) * front.columns;
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {  // rows of each front in its parent
    Front& front = fronts_[f];
    if (front.updateRows() == 1) continue;
    const std::vector<int>& below = structure[supernodes->last[f]];
    const int up = supernodes->of[below.front()];
    fronts_[up].children.push_back(static_cast<int>(f));
    supernodes->enter(up);
    const auto append = [&](int parent_row, int size) {
      const int child_row = front.to_parent.empty() ? 0 : front.to_parent.back().child + front.to_parent.back().size;
      if (!front.to_parent.empty() && front.to_parent.back().parent + front.to_parent.back().size == parent_row)
        front.to_parent.back().size += size;
      else
        front.to_parent.push_back({child_row, parent_row, size});
      if (parent_row < fronts_[up].columns) front.parent_pivots += size;
    };
    for (const int p : below) append(supernodes->offset_in_front[p], sizeAt(p));
    append(fronts_[up].rows - 1, 1);
  }
}

// Offset of each block of the matrix in the values, which are in the order in which the fronts read them.
void SparseCholesky::placeBlocks(const std::vector<std::pair<int, int>>& pairs, Supernodes* supernodes) {
  const int n = nodes();
  struct Placed {
    int earlier, later;
    std::size_t* value_offset;
  };
  std::vector<Placed> placed, ordered(n + pairs.size());
  placed.reserve(ordered.size());
  for (int v = 0; v < n; ++v) placed.push_back({position_[v], position_[v], &diagonal_offset_[v]});
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const int a = position_[pairs[k].first], b = position_[pairs[k].second];
    placed.push_back({std::min(a, b), std::max(a, b), &pair_offset_[k]});
  }
  // Sorted by column, then by row: two stable bucket sorts, the minor key first.
  std::vector<int> begin;
  const auto sortBy = [&](int Placed::*key) {
    begin.assign(n + 1, 0);
    for (const Placed& b : placed) ++begin[b.*key + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const Placed& b : placed) ordered[begin[b.*key]++] = b;
    placed.swap(ordered);
  };
  sortBy(&Placed::later);
  sortBy(&Placed::earlier);
  value_count_ = 0;
  int front = -1;
  for (const Placed& b : placed) {
    if (supernodes->of[b.earlier] != front) {
      front = supernodes->of[b.earlier];
      supernodes->enter(front);
    }
    const Entry entry{value_count_, supernodes->offset_in_front[b.later], supernodes->offset_in_front[b.earlier],
                      sizeAt(b.later), sizeAt(b.earlier)};
    *b.value_offset = value_count_;
    value_count_ += blockValues(entry.rows, entry.columns);
    fronts_[front].entries.push_back(entry);
  }
}

void SparseCholesky::analyze(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& pairs) {
  sizes_ = sizes;
  const int n = nodes();
  unknown_.resize(n);
  diagonal_offset_.resize(n);
  pair_offset_.resize(pairs.size());
  dimension_ = 0;
  for (int v = 0; v < n; ++v) {
    unknown_[v] = dimension_;
    dimension_ += sizes[v];
  }
  const Lists structure = order(pairs);
  Supernodes supernodes = joinSupernodes(structure);
  layFronts(structure, &supernodes);
  splitTree();
  placeUpdates();
  placeBlocks(pairs, &supernodes);
  factor_.resize(factor_size_);
  work_.assign(dimension_ + kKernelLanes, 0.0);
}

}  // namespace vip_slam
