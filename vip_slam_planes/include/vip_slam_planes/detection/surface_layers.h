// SPDX-License-Identifier: BSD-3-Clause
// Separates parallel surfaces close to each other in one peak of the histogram: a worktop and the trays on it, two
// steps of a stair. A joint fit would lie on neither. The distances along the normal of one surface have one mode,
// however noisy; a valley between two modes shows two surfaces, independent of the histogram's bins.
#pragma once

#include <vector>

namespace vip_slam {

/// Indices of the votes, ascending, per layer, the layer with the largest weight first; one layer when there is no
/// valley. `offset`: distance of each vote along the normal, `sigma`: noise of one, metres.
std::vector<std::vector<int>> splitLayers(const std::vector<double>& offset, const std::vector<double>& weight,
                                          double sigma);

}  // namespace vip_slam
