// SPDX-License-Identifier: BSD-3-Clause
// Elimination order of a sparse Cholesky factorisation, and its elimination tree.
#pragma once

#include <vector>

namespace vip_slam {

using Lists = std::vector<std::vector<int>>;

/// Approximate minimum degree on units of three unknowns (a pose has two, a motion three, a plane one), so that degrees
/// reflect the nodes' sizes. Returns each node's position in the order. `neighbours`: ascending, without the node
/// itself. Throws std::runtime_error when the lists are not consistent.
std::vector<int> minimumDegree(const std::vector<int>& sizes, const Lists& neighbours);

/// Structure of the factor below each node, in positions, ascending; `parent`: of each position in the elimination
/// tree, -1 for roots.
Lists eliminate(const Lists& neighbours, const std::vector<int>& position, std::vector<int>* parent);

/// An order of the positions in which each comes after its children.
std::vector<int> postorder(const std::vector<int>& parent);

}  // namespace vip_slam
