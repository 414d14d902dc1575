// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/trajectory_consistency.h"

#include <algorithm>

#include <Eigen/Cholesky>

namespace vip_slam {
namespace {

constexpr double kChiSquare95Of6 = 12.5916;

}  // namespace

Coverage coverage(const Trajectory& truth, const Trajectory& estimate, double gap_seconds, double time_offset) {
  Coverage result;
  if (truth.size() < 2) return result;
  const double begin = truth.front().t, end = truth.back().t;
  double missing = 0, previous = begin;
  const auto step = [&](double t) {
    if (t - previous > gap_seconds) {
      result.gaps.push_back({previous, t});
      result.longest_gap = std::max(result.longest_gap, t - previous);
      missing += t - previous;
    }
    previous = std::max(previous, t);
  };
  for (const StampedPose& pose : estimate) step(std::clamp(pose.t + time_offset, begin, end));
  step(end);
  result.fraction = 1.0 - missing / (end - begin);
  return result;
}

std::vector<JoinedError> joinedErrors(const Trajectory& truth, const std::vector<PoseWithCovariance>& estimate,
                                      double max_gap, double time_offset, bool level) {
  std::vector<JoinedError> result;
  bool joined = false;
  SE3 T_M_W;
  for (const PoseWithCovariance& sample : estimate) {
    SE3 T_W_B;
    if (!poseAt(truth, sample.t + time_offset, &T_W_B, max_gap)) continue;
    if (!joined) {
      joined = true;
      T_M_W = level ? alignLevelled(sample.T_M_B, T_W_B) : sample.T_M_B * T_W_B.inverse();
    }
    const SE3 T_M_B = T_M_W * T_W_B;
    JoinedError e;
    e.t = sample.t;
    e.error << sample.T_M_B.t() - T_M_B.t(), logSO3(sample.T_M_B.rotation() * T_M_B.rotation().conjugate());
    e.covariance = sample.covariance;
    const Eigen::LLT<Matrix6d> llt(e.covariance);
    e.nees = llt.info() == Eigen::Success ? e.error.dot(llt.solve(e.error)) : -1.0;
    result.push_back(e);
  }
  return result;
}

Nees nees(const Trajectory& truth, const std::vector<PoseWithCovariance>& estimate, double max_gap, double time_offset,
          bool level) {
  Nees result;
  std::vector<double> pose, position, rotation;
  std::size_t within = 0;
  for (const JoinedError& e : joinedErrors(truth, estimate, max_gap, time_offset, level)) {
    const Eigen::LLT<Eigen::Matrix3d> llt_p(e.covariance.topLeftCorner<3, 3>());
    const Eigen::LLT<Eigen::Matrix3d> llt_r(e.covariance.bottomRightCorner<3, 3>());
    if (e.nees < 0 || llt_p.info() != Eigen::Success || llt_r.info() != Eigen::Success) {
      ++result.unusable;
      continue;
    }
    pose.push_back(e.nees);
    position.push_back(e.error.head<3>().dot(llt_p.solve(e.error.head<3>())));
    rotation.push_back(e.error.tail<3>().dot(llt_r.solve(e.error.tail<3>())));
    if (e.nees <= kChiSquare95Of6) ++within;
  }
  if (!pose.empty()) result.within_95 = double(within) / double(pose.size());
  result.pose = summarise(std::move(pose));
  result.position = summarise(std::move(position));
  result.rotation = summarise(std::move(rotation));
  return result;
}

}  // namespace vip_slam
