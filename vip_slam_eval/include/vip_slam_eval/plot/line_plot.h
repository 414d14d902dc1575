// SPDX-License-Identifier: BSD-3-Clause
// Plain line plots as PNG.
#pragma once

#include <string>
#include <vector>

namespace vip_slam {

struct PlotSeries {
  std::string name;
  std::vector<double> x, y;
};

/// Throws std::runtime_error naming the path when it cannot be written.
void writeLinePlot(const std::string& path, const std::string& title, const std::string& x_label,
                   const std::string& y_label, const std::vector<PlotSeries>& series);

}  // namespace vip_slam
