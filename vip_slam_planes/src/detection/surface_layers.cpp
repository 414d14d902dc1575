// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/surface_layers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

constexpr double kFinest = 0.0025;  // m, bins of the distances along the normal
constexpr double kValley = 0.4;     // largest height of a valley, relative to the lower of the two modes
constexpr double kMinShare = 0.2;   // of the whole weight; a smaller part counts as outliers

struct Bin {
  double weight = 0, hump = 0;  ///< of its votes; smoothed
  double below = 0;             ///< weight of the bins before this one
  int votes_below = 0;
};

// Splits [first, last) recursively at its deepest valley; adds the first bins of the upper parts to `cuts`. One more
// bin follows the last.
void cutAtValleys(const std::vector<Bin>& bins, int first, int last, std::vector<int>* cuts) {
  const double least = kMinShare * bins.back().below;
  const auto suffices = [&](int from, int to) {
    const int votes = bins[to].votes_below - bins[from].votes_below;
    // Counts scatter by their root: few votes have valleys by chance.
    return bins[to].below - bins[from].below >= least && votes > kNoiseSigmas * std::sqrt(double(votes));
  };
  std::vector<double> right(last - first + 1, 0);
  for (int i = last - 1; i >= first; --i) right[i - first] = std::max(right[i - first + 1], bins[i].hump);
  double left = 0, deepest = kValley;
  int cut = -1;
  for (int i = first; i < last; ++i) {
    left = std::max(left, bins[i].hump);
    if (!suffices(first, i) || !suffices(i, last)) continue;
    const double depth = bins[i].hump / std::min(left, right[i - first]);
    if (depth < deepest) deepest = depth, cut = i;
  }
  if (cut < 0) return;
  cutAtValleys(bins, first, cut, cuts);
  cuts->push_back(cut);
  cutAtValleys(bins, cut, last, cuts);
}

}  // namespace

std::vector<std::vector<int>> splitLayers(const std::vector<double>& offset, const std::vector<double>& weight,
                                          double sigma) {
  std::vector<std::vector<int>> layers(1);
  layers[0].resize(offset.size());
  std::iota(layers[0].begin(), layers[0].end(), 0);
  if (offset.empty()) return layers;
  const auto [low, high] = std::minmax_element(offset.begin(), offset.end());
  const double per_vote = (*high - *low) / double(offset.size());  // more bins than votes would be empty
  const double bin = std::max({kFinest, 0.5 * sigma, per_vote});
  const int count = static_cast<int>((*high - *low) / bin) + 1;
  const auto binOf = [&, low = *low](double d) { return std::min(count - 1, static_cast<int>((d - low) / bin)); };
  std::vector<Bin> bins(count + 1);
  for (std::size_t i = 0; i < offset.size(); ++i) {
    bins[binOf(offset[i])].weight += weight[i];
    ++bins[binOf(offset[i]) + 1].votes_below;
  }
  for (int b = 0; b < count; ++b) {
    bins[b + 1].below = bins[b].below + bins[b].weight;
    bins[b + 1].votes_below += bins[b].votes_below;
    for (int k = std::max(-2, -b); k <= 2 && b + k < count; ++k) bins[b].hump += (3 - std::abs(k)) * bins[b + k].weight;
  }
  std::vector<int> cuts;
  cutAtValleys(bins, 0, count, &cuts);
  if (cuts.empty()) return layers;

  layers.assign(cuts.size() + 1, {});
  for (std::size_t i = 0; i < offset.size(); ++i) {
    layers[std::upper_bound(cuts.begin(), cuts.end(), binOf(offset[i])) - cuts.begin()].push_back(static_cast<int>(i));
  }
  const auto weightOf = [&](const std::vector<int>& layer) {
    return std::accumulate(layer.begin(), layer.end(), 0.0, [&](double sum, int i) { return sum + weight[i]; });
  };
  std::stable_sort(layers.begin(), layers.end(),
                   [&](const auto& a, const auto& b) { return weightOf(a) > weightOf(b); });
  return layers;
}

}  // namespace vip_slam
