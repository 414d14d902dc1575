// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/report/metric_table.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

namespace vip_slam {

std::string shortNumber(double value, int digits) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  if (value != 0 && std::abs(value) < 1e-4) {
    out << std::scientific << std::setprecision(std::max(0, digits - 2)) << value;
    return out.str();
  }
  // The first significant digit stands for 10^exponent.
  const int exponent = value == 0 ? 0 : static_cast<int>(std::floor(std::log10(std::abs(value))));
  const bool whole = value == std::floor(value) && std::abs(value) < 1e15;
  const int decimals = whole ? 0 : std::max(0, digits - 1 - exponent);
  out << std::fixed << std::setprecision(decimals) << value;
  return out.str();
}

void printMetrics(std::ostream& out, const MetricTable& table) {
  std::size_t width = 0, value_width = 0;
  for (const Metric& metric : table) {
    width = std::max(width, metric.name.size());
    value_width = std::max(value_width, shortNumber(metric.value).size());
  }
  std::string group;
  for (const Metric& metric : table) {
    if (metric.group != group) out << metric.group << "\n";
    group = metric.group;
    out << "  " << std::left << std::setw(static_cast<int>(width)) << metric.name << "  " << std::right
        << std::setw(static_cast<int>(value_width)) << shortNumber(metric.value) << "  " << metric.unit << "\n";
  }
}

void writeMetricsCsv(std::ostream& out, const MetricTable& table) {
  out << "group,name,value,unit\n";
  const auto cell = [](const std::string& text) {
    return text.find(',') == std::string::npos ? text : "\"" + text + "\"";
  };
  for (const Metric& metric : table) {
    out << cell(metric.group) << ',' << cell(metric.name) << ',' << shortNumber(metric.value, 9) << ',' << metric.unit
        << '\n';
  }
}

}  // namespace vip_slam
