// In which order a sparse Cholesky factorisation takes its nodes, and what depends on what.
#pragma once

#include <vector>

namespace vip_slam {

using Lists = std::vector<std::vector<int>>;

/// Approximate minimum degree on thirds of unknowns (a pose counts two, a motion three, a plane one), so that degrees
/// count what the nodes weigh. Returns each node's place in the order. `neighbours`: ascending, without the node
/// itself. Throws std::runtime_error when the lists are not sound.
std::vector<int> minimumDegree(const std::vector<int>& sizes, const Lists& neighbours);

/// Structure of the factor below each node, in positions, ascending; `parent`: of each position in the elimination
/// tree, -1 for roots.
Lists eliminate(const Lists& neighbours, const std::vector<int>& position, std::vector<int>* parent);

/// Positions so that each comes after its children.
std::vector<int> postorder(const std::vector<int>& parent);

}  // namespace vip_slam
