// SPDX-License-Identifier: BSD-3-Clause
#include "elimination_tree.h"

#include <algorithm>
#include <stdexcept>

#include <amd.h>

namespace vip_slam {

// A node takes the position of the first of its parts; these have equal structure, so the ordering keeps them together.
std::vector<int> minimumDegree(const std::vector<int>& sizes, const Lists& neighbours) {
  const int n = static_cast<int>(sizes.size());
  std::vector<int> first(1, 0), node_of, starts(1, 0), indices;
  for (int v = 0; v < n; ++v) {
    first.push_back(first.back() + (sizes[v] + 2) / 3);
    node_of.resize(first.back(), v);
  }
  for (int v = 0; v < n; ++v)
    for (int part = first[v]; part < first[v + 1]; ++part) {
      const auto add = [&](int w) {
        for (int k = first[w]; k < first[w + 1]; ++k)
          if (k != part) indices.push_back(k);
      };
      bool self = false;  // whether v itself has been inserted at its place in the ascending order
      for (const int w : neighbours[v]) {
        if (w > v && !self) {
          add(v);
          self = true;
        }
        add(w);
      }
      if (!self) add(v);
      starts.push_back(static_cast<int>(indices.size()));
    }
  if (indices.empty()) indices.push_back(0);
  std::vector<int> permutation(node_of.size());
  const int status =
      n == 0 ? AMD_OK : amd_order(first[n], starts.data(), indices.data(), permutation.data(), nullptr, nullptr);
  if (status != AMD_OK && status != AMD_OK_BUT_JUMBLED) throw std::runtime_error("sparse Cholesky: ordering failed");
  std::vector<int> position(n, -1);
  int next = 0;
  for (const int part : permutation)
    if (position[node_of[part]] < 0) position[node_of[part]] = next++;
  return position;
}

Lists eliminate(const Lists& neighbours, const std::vector<int>& position, std::vector<int>* parent) {
  const int n = static_cast<int>(neighbours.size());
  std::vector<int> node_at(n);
  for (int v = 0; v < n; ++v) node_at[position[v]] = v;
  Lists structure(n), children(n);
  std::vector<int> mark(n, -1);
  parent->assign(n, -1);
  for (int k = 0; k < n; ++k) {
    mark[k] = k;
    std::vector<int>& s = structure[k];
    const auto take = [&](int p) {
      if (p > k && mark[p] != k) {
        mark[p] = k;
        s.push_back(p);
      }
    };
    for (const int v : neighbours[node_at[k]]) take(position[v]);
    for (const int c : children[k])
      for (const int p : structure[c]) take(p);
    std::sort(s.begin(), s.end());
    if (!s.empty()) {
      (*parent)[k] = s.front();
      children[s.front()].push_back(k);
    }
  }
  return structure;
}

std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  Lists children(n);
  std::vector<int> roots, order;
  for (int k = 0; k < n; ++k) (parent[k] < 0 ? roots : children[parent[k]]).push_back(k);
  std::vector<std::pair<int, std::size_t>> stack;
  for (const int root : roots) {
    stack.emplace_back(root, 0);
    while (!stack.empty()) {
      auto& top = stack.back();
      if (top.second < children[top.first].size()) {
        const int child = children[top.first][top.second++];
        stack.emplace_back(child, 0);
      } else {
        order.push_back(top.first);
        stack.pop_back();
      }
    }
  }
  return order;
}

}  // namespace vip_slam
