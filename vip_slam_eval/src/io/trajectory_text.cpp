// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/io/trajectory_text.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/SVD>

#include "vip_slam_bringup/convert/text_table.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr std::size_t kTum = 8, kKitti = 12, kEuroc = 8;  // columns; EuRoC's goes on with velocity and biases

/// Whether the first row of numbers has commas.
bool hasCommas(const std::string& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first != std::string::npos && std::string("+-.0123456789").find(line[first]) != std::string::npos)
      return line.find(',') != std::string::npos;
  }
  return false;
}

Trajectory readEuroc(const std::string& path) {
  const TextTable table(path, ",", kEuroc);
  Trajectory trajectory;
  for (const TextRow& row : table.rows()) {
    double v[kEuroc];  // the first is the stamp
    for (std::size_t i = 1; i < kEuroc; ++i) v[i] = table.number(row, i, "column " + std::to_string(i + 1));
    const double t = table.seconds(row);
    if (!trajectory.empty()) table.ascending(row, trajectory.back().t, t);
    trajectory.push_back({t, SE3(table.quaternion(row, v[4], v[5], v[6], v[7]), Eigen::Vector3d(v[1], v[2], v[3]))});
  }
  return trajectory;
}

Trajectory readKitti(const TextTable& poses, const std::string& times_path) {
  constexpr double kOffRotation = 0.05;  // of a matrix that is written with few digits
  if (times_path.empty())
    throw std::runtime_error(poses.path() + ": KITTI poses have no stamps, expected a times file too (--truth-times)");
  const TextTable times(times_path, " \t,", 1);
  if (times.rows().size() != poses.rows().size())
    throw std::runtime_error(formatted("%s: %zu stamps, expected %zu, one for each pose of %s", times_path.c_str(),
                                       times.rows().size(), poses.rows().size(), poses.path().c_str()));
  Trajectory trajectory;
  for (std::size_t k = 0; k < poses.rows().size(); ++k) {
    const TextRow& row = poses.rows()[k];
    if (row.cells.size() != kKitti) poses.fail(row, formatted("%zu numbers, expected 12", row.cells.size()));
    Eigen::Matrix<double, 3, 4, Eigen::RowMajor> T;
    for (std::size_t i = 0; i < kKitti; ++i) T.data()[i] = poses.number(row, i, "column " + std::to_string(i + 1));
    const Eigen::Matrix3d R = T.leftCols<3>();
    if ((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() > kOffRotation || R.determinant() < 0)
      poses.fail(row, "its first three columns are no rotation, expected the rows of a 3 x 4 pose");
    const double t = times.seconds(times.rows()[k]);
    if (!trajectory.empty()) times.ascending(times.rows()[k], trajectory.back().t, t);
    trajectory.push_back({t, SE3(nearestRotation(R), T.col(3))});
  }
  return trajectory;
}

/// RMS of what the best constant rotation leaves of `a` against `b`.
double misfit(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += b[i] * a[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Eigen::Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  double rest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) rest += (b[i] - R * a[i]).squaredNorm();
  return std::sqrt(rest / static_cast<double>(a.size()));
}

}  // namespace

Trajectory rereadQuaternions(const Trajectory& trajectory, bool scalar_first) {
  Trajectory out = trajectory;
  for (StampedPose& pose : out) {
    const Eigen::Quaterniond& q = pose.T_W_B.rotation();
    pose.T_W_B = SE3(
        scalar_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()) : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()),
        pose.T_W_B.t());
  }
  return out;
}

std::optional<bool> scalarFirst(const std::string& path) {
  if (path.size() > 4 && path.compare(path.size() - 4, 4, ".bag") == 0) return std::nullopt;
  const bool commas = hasCommas(path);
  if (!commas && TextTable(path, " \t", 1).rows().front().cells.size() == kKitti) return std::nullopt;
  return commas;
}

Trajectory readTextTrajectory(const std::string& path, const std::string& times, std::string* ran_back) {
  const bool commas = hasCommas(path);
  const TextTable table(path, commas ? "," : " \t", 1);
  const TextRow& first = table.rows().front();
  const std::size_t columns = first.cells.size();
  if (!commas && columns == kKitti) return readKitti(table, times);
  if (!times.empty())
    throw std::runtime_error(times + ": stamps are for KITTI poses (12 numbers in a row), not for " + path);
  if (commas && columns >= kEuroc) return readEuroc(path);
  if (!commas && columns == kTum) return readTum(path, ran_back);
  table.fail(first, formatted("%zu numbers between %s, expected 8 between blanks (TUM: t tx ty tz qx qy qz qw), 8 or "
                              "more between commas (EuRoC: t,px,py,pz,qw,qx,qy,qz,...) or 12 between blanks (KITTI)",
                              columns, commas ? "commas" : "blanks"));
}

QuaternionOrder quaternionOrder(const Trajectory& truth, const Trajectory& reread, const Trajectory& estimate,
                                double time_offset, double max_gap) {
  constexpr double kStep = 1.0;      // s
  constexpr double kTurning = 0.05;  // rad, RMS: below it errors of the estimate decide
  constexpr std::size_t kFewest = 10;
  constexpr double kFits = 0.3, kFitsNot = 0.5;  // of the turning
  std::vector<Eigen::Vector3d> as_read, swapped, estimated;
  const auto turn = [](const SE3& a, const SE3& b) { return logSO3(a.rotation().conjugate() * b.rotation()); };
  const StampedPose* from = nullptr;
  for (const StampedPose& pose : estimate) {
    if (from && pose.t - from->t < kStep) continue;
    SE3 a, b;
    if (from && poseAt(truth, from->t + time_offset, &a, max_gap) && poseAt(truth, pose.t + time_offset, &b, max_gap)) {
      as_read.push_back(turn(a, b));
      estimated.push_back(turn(from->T_W_B, pose.T_W_B));
      poseAt(reread, from->t + time_offset, &a, max_gap);
      poseAt(reread, pose.t + time_offset, &b, max_gap);
      swapped.push_back(turn(a, b));
    }
    from = &pose;
  }
  QuaternionOrder order;
  if (estimated.size() < kFewest) return order;
  double sum = 0;
  for (const Eigen::Vector3d& step : estimated) sum += step.squaredNorm();
  order.turning = std::sqrt(sum / static_cast<double>(estimated.size()));
  order.misfit = misfit(as_read, estimated);
  order.misfit_swapped = misfit(swapped, estimated);
  order.swapped = order.turning > kTurning && order.misfit > kFitsNot * order.turning &&
                  order.misfit_swapped < kFits * order.turning;
  return order;
}

}  // namespace vip_slam
