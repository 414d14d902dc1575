// SPDX-License-Identifier: BSD-3-Clause
// Summary of a list of errors.
#pragma once

#include <cstddef>
#include <vector>

namespace vip_slam {

/// All zero when there are no values.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0, mean = 0, median = 0, p95 = 0, max = 0;
};

ErrorStatistics summarise(std::vector<double> errors);

}  // namespace vip_slam
