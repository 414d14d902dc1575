// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <fstream>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "vip_slam_eval/io/trajectory_source.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

std::vector<PoseWithCovariance> readCovariances(const std::string& path, const Trajectory& trajectory) {
  constexpr double kSameStamp = 1e-6;  // both files are written with nine decimals
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened, expected a CSV file of covariances");
  std::vector<PoseWithCovariance> samples;
  auto pose = trajectory.begin();
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::string where = path + ":" + std::to_string(number) + ": ";
    if (number == 1) {
      if (line.rfind("t,xx,xy,xz,", 0) != 0)
        throw std::runtime_error(where + "expected the header t,xx,xy,xz,...,cc, found '" + line + "'");
      continue;
    }
    if (line.empty()) continue;
    std::istringstream in(line);
    in.imbue(std::locale::classic());
    PoseWithCovariance sample;
    in >> sample.t;
    char comma = ',';
    for (int r = 0; r < 6; ++r) {
      for (int c = r; c < 6; ++c) {
        char between = 0;
        in >> between >> sample.covariance(r, c);
        if (between != ',') comma = between;
        sample.covariance(c, r) = sample.covariance(r, c);
      }
    }
    if (in.fail() || comma != ',' || in.peek() != std::istringstream::traits_type::eof() ||
        !sample.covariance.allFinite()) {
      throw std::runtime_error(where + "expected a stamp and 21 finite numbers, found '" + line + "'");
    }
    if (!samples.empty() && sample.t < samples.back().t + kSameStamp) continue;
    while (pose != trajectory.end() && pose->t < sample.t - kSameStamp) ++pose;
    if (pose == trajectory.end() || std::abs(pose->t - sample.t) > kSameStamp) {
      throw std::runtime_error(where + "no pose of the estimate has this stamp, " + formatted("%.9f", sample.t) +
                               ", expected the covariances of its poses");
    }
    sample.T_M_B = pose->T_W_B;
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace vip_slam
