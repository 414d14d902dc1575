// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/statistics.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

ErrorStatistics summarise(std::vector<double> errors) {
  ErrorStatistics s;
  s.count = errors.size();
  if (errors.empty()) return s;
  std::sort(errors.begin(), errors.end());
  for (const double e : errors) {
    s.mean += e;
    s.rmse += e * e;
  }
  s.mean /= double(s.count);
  s.rmse = std::sqrt(s.rmse / double(s.count));
  const std::size_t half = s.count / 2;
  s.median = s.count % 2 == 1 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
  s.p95 = errors[static_cast<std::size_t>(std::ceil(0.95 * double(s.count))) - 1];
  s.max = errors.back();
  return s;
}

}  // namespace vip_slam
