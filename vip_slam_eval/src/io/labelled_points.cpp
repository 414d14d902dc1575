// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_eval/metrics/association_metrics.h"

namespace vip_slam {
namespace {

const std::string kHeader = "id,x,y,z,plane,keyframes";

}  // namespace

std::vector<LabelledPoint> readLabelledPoints(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened, expected a CSV file of points");
  std::vector<LabelledPoint> points;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (line != kHeader) throw std::runtime_error(path + ":1: '" + line + "', expected the header " + kHeader);
      continue;
    }
    if (line.empty()) continue;
    LabelledPoint point;
    char c1 = 0, c2 = 0, c3 = 0, c4 = 0, c5 = 0;
    std::istringstream in(line);
    in.imbue(std::locale::classic());
    in >> point.id >> c1 >> point.p_W.x() >> c2 >> point.p_W.y() >> c3 >> point.p_W.z() >> c4 >> point.plane >> c5 >>
        point.keyframes;
    const bool commas = c1 == ',' && c2 == ',' && c3 == ',' && c4 == ',' && c5 == ',';
    if (in.fail() || !commas || in.peek() != std::istringstream::traits_type::eof() || !point.p_W.allFinite()) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": '" + line + "', expected " + kHeader +
                               " with finite numbers");
    }
    points.push_back(point);
  }
  return points;
}

void writeLabelledPoints(const std::string& path, const std::vector<LabelledPoint>& points) {
  AtomicFile file(path);
  file.stream() << kHeader << "\n" << std::fixed << std::setprecision(6);
  for (const LabelledPoint& p : points) {
    file.stream() << p.id << ',' << p.p_W.x() << ',' << p.p_W.y() << ',' << p.p_W.z() << ',' << p.plane << ','
                  << p.keyframes << '\n';
  }
  file.commit();
}

}  // namespace vip_slam
