// SPDX-License-Identifier: BSD-3-Clause
// The jackknife: how much an estimate varies when each part of its data is left out in turn. It asks for no derivative
// and no noise model, and shows what a single part has decided.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace vip_slam {

/// Parts that are left out in turn. Fits to depth ask for half as many keyframes.
constexpr int kGroups = 20;

/// One sigma of `estimate(items)`, a std::optional<double>, from leaving out each of kGroups parts of the items, or
/// of fewer items, which follow each other: what lies near in time shares its errors. Nothing when the estimate is not
/// known without some part, or when there are fewer than two.
template <class Item, class Estimate>
std::optional<double> jackknifeSigma(const std::vector<Item>& items, const Estimate& estimate) {
  const std::size_t parts = std::min<std::size_t>(items.size(), kGroups);
  if (parts < 2) return std::nullopt;
  std::vector<double> without;
  double mean = 0, squares = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<Item> others;
    for (std::size_t k = 0; k < items.size(); ++k)
      if (k * parts / items.size() != part) others.push_back(items[k]);
    const std::optional<double> value = estimate(others);
    if (!value) return std::nullopt;
    without.push_back(*value);
    mean += *value / static_cast<double>(parts);
  }
  for (const double value : without) squares += (value - mean) * (value - mean);
  return std::sqrt(squares * static_cast<double>(parts - 1) / static_cast<double>(parts));
}

}  // namespace vip_slam
