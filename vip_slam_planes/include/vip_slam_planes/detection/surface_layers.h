// Parallel surfaces close to each other in one peak of the histogram: a worktop and the trays on it, two steps of a
// stair. A fit to both lies in neither. One surface gives one hump of distances along the normal, however noisy; a
// valley between two humps tells them apart, whatever the bins are.
#pragma once

#include <vector>

namespace vip_slam {

/// Indices of the votes, ascending, layer by layer with the largest weight first; one layer when there is no valley.
/// `offset` is the distance of each vote along the normal, `sigma` the noise of one, metres.
std::vector<std::vector<int>> splitLayers(const std::vector<double>& offset, const std::vector<double>& weight,
                                          double sigma);

}  // namespace vip_slam
