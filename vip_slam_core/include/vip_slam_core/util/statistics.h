// SPDX-License-Identifier: BSD-3-Clause
// Order statistics of a few numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace vip_slam {

/// The `q`-quantile (0 to 1) of `values`, one of them (no interpolation). `values` must not be empty.
template <class T>
T quantile(std::vector<T> values, double q) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// The middle value, of an even number of them the upper of the two. `values` must not be empty.
template <class T>
T upperMedian(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vip_slam
