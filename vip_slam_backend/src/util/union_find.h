// SPDX-License-Identifier: BSD-3-Clause
// Disjoint sets of numbers; the least number of a set stands for it.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace vip_slam {

class UnionFind {
 public:
  explicit UnionFind(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(int a, int b) { parent_[std::max(find(a), find(b))] = std::min(find(a), find(b)); }

 private:
  std::vector<int> parent_;
};

}  // namespace vip_slam
