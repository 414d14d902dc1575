// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/trajectory/tum_io.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "util/text.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/stamp_unit.h"

namespace vip_slam {
namespace {

StampedPose parseLine(const std::string& line, const std::string& where) {
  std::istringstream fields(line);
  std::vector<double> values;
  for (std::string word; fields >> word;) {
    double value;
    if (!parseDouble(word, &value)) throw std::runtime_error(where + "'" + word + "' is not a number");
    if (!std::isfinite(value)) throw std::runtime_error(where + "'" + word + "', expected a finite number");
    values.push_back(value);
  }
  if (values.size() != 8) {
    throw std::runtime_error(where + std::to_string(values.size()) +
                             " values, expected 8: timestamp tx ty tz qx qy qz qw");
  }
  const Eigen::Quaterniond q(values[7], values[4], values[5], values[6]);
  if (!(std::abs(q.norm() - 1.0) < 0.05)) {
    throw std::runtime_error(where + "quaternion of length " + formatDouble(q.norm()) + ", expected a unit quaternion");
  }
  return {values[0], SE3(q, Eigen::Vector3d(values[1], values[2], values[3]))};
}

}  // namespace

Trajectory readTum(const std::string& path, std::string* ran_back) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened, expected a TUM trajectory");
  Trajectory trajectory;
  std::string line, first_back;
  std::size_t left_out = 0;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    const std::string where = path + ":" + std::to_string(number) + ": ";
    const StampedPose pose = parseLine(line, where);
    if (!trajectory.empty() && pose.t == trajectory.back().t) continue;  // public recordings repeat a few poses
    if (!trajectory.empty() && !(pose.t > trajectory.back().t)) {
      if (first_back.empty())
        first_back = where + "timestamp " + formatDouble(pose.t) + " does not follow " +
                     formatDouble(trajectory.back().t) + ", ";
      if (!ran_back) throw std::runtime_error(first_back + "expected ascending times");
      ++left_out;
      continue;
    }
    trajectory.push_back(pose);
  }
  if (!trajectory.empty()) {
    const double unit = secondsPerUnit(trajectory.front().t, trajectory.back().t, trajectory.size());
    if (unit != 1.0)
      for (StampedPose& pose : trajectory) pose.t *= unit;
  }
  if (left_out > 0 && left_out >= trajectory.size())
    throw std::runtime_error(first_back + "and so most of them; expected ascending times");
  if (left_out > 0)
    *ran_back = first_back + "a clock that was set back? " + std::to_string(left_out) +
                " poses are left out, until time goes on; later stamps may be of another clock than those before";
  if (file.bad()) throw std::runtime_error(path + ": reading failed, expected a text file");
  return trajectory;
}

void writeTum(const std::string& path, const Trajectory& trajectory) {
  AtomicFile file(path);
  std::ofstream& out = file.stream();
  out << "# timestamp tx ty tz qx qy qz qw\n" << std::fixed << std::setprecision(9);
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d& t = pose.T_W_B.t();
    const Eigen::Quaterniond& q = pose.T_W_B.rotation();
    out << pose.t << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
        << q.w() << '\n';
  }
  file.commit();
}

bool poseAt(const Trajectory& trajectory, double t, SE3* T_W_B, double max_gap) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), t,
                                      [](const StampedPose& pose, double time) { return pose.t < time; });
  if (after == trajectory.end()) return false;
  if (after->t == t) {
    *T_W_B = after->T_W_B;
    return true;
  }
  if (after == trajectory.begin()) return false;
  const StampedPose& before = *std::prev(after);
  if (after->t - before.t > max_gap) return false;
  *T_W_B = interpolate(before.T_W_B, after->T_W_B, (t - before.t) / (after->t - before.t));
  return true;
}

}  // namespace vip_slam
