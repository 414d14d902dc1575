// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "vip_slam_sim/motion/motion_generator.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

/// EuRoC state_groundtruth_estimate0: t[ns], p xyz, q wxyz, ...
Trajectory readEuroc(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  Trajectory out;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    for (char& c : line)
      if (c == ',') c = ' ';
    std::stringstream s(line);
    double t, x, y, z, qw, qx, qy, qz;
    const std::string where = path + ":" + std::to_string(number) + ": ";
    if (!(s >> t >> x >> y >> z >> qw >> qx >> qy >> qz))
      throw std::runtime_error(where + "'" + line + "', expected 't[ns],px,py,pz,qw,qx,qy,qz,...'");
    const Eigen::Quaterniond q(qw, qx, qy, qz);
    if (!(std::abs(q.norm() - 1) < 0.05))
      throw std::runtime_error(where + formatted("quaternion of length %g, expected a unit quaternion", q.norm()));
    if (!out.empty() && t * 1e-9 <= out.back().t)
      throw std::runtime_error(where + formatted("stamp %.9f s does not follow %.9f s", t * 1e-9, out.back().t));
    out.push_back({t * 1e-9, SE3(q, Eigen::Vector3d(x, y, z))});
  }
  return out;
}

}  // namespace

Trajectory readPoseFile(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  std::string line;
  while (std::getline(in, line))
    if (!line.empty() && line[0] != '#') break;
  Trajectory out = line.find(',') != std::string::npos ? readEuroc(path) : readTum(path);
  if (out.size() < 2) throw std::runtime_error(path + formatted(": %zu poses, expected at least two", out.size()));
  const double first = out.front().t;
  for (StampedPose& p : out) p.t -= first;
  return out;
}

}  // namespace vip_slam
