// SPDX-License-Identifier: BSD-3-Clause
// A list of named values and its two output formats: terminal table and CSV.
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace vip_slam {

struct Metric {
  std::string group;  ///< "ATE yaw"
  std::string name;   ///< "position rmse"
  double value = 0;
  std::string unit;  ///< "m"
};
using MetricTable = std::vector<Metric>;

void printMetrics(std::ostream& out, const MetricTable& table);
/// Columns group,name,value,unit.
void writeMetricsCsv(std::ostream& out, const MetricTable& table);

/// A number with at most `digits` significant digits, without exponent for ordinary magnitudes.
std::string shortNumber(double value, int digits = 4);

}  // namespace vip_slam
