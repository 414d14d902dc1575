// SPDX-License-Identifier: BSD-3-Clause
// How well the pose-plane graph knows one keyframe from another: the best way along its edges.
#include <algorithm>
#include <limits>
#include <queue>
#include <vector>

#include <Eigen/LU>

#include "vip_slam_backend/loop/pose_plane_graph.h"
#include "vip_slam_core/geometry/relative_motion.h"

namespace vip_slam {
namespace {

// The same motion the other way round.
RelativeMotion inverse(const RelativeMotion& ab) {
  RelativeMotion ba;
  ba.T_a_b = ab.T_a_b.inverse();
  const Eigen::Matrix3d R_ab = ab.T_a_b.R();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = -R_ab;
  J.bottomLeftCorner<3, 3>() = hat(ba.T_a_b.t());
  J.bottomRightCorner<3, 3>() = -R_ab.transpose();
  ba.covariance = J * ab.covariance * J.transpose();
  return ba;
}

}  // namespace

std::optional<Eigen::Matrix3d> PosePlaneGraph::positionCovariance(KeyframeId from, KeyframeId to) const {
  struct Step {
    KeyframeId to;
    const RelativePoseEdge* edge;
  };
  std::map<KeyframeId, std::vector<Step>> steps;
  for (const RelativePoseEdge& edge : relative_) {
    steps[edge.i].push_back({edge.j, &edge});
    steps[edge.j].push_back({edge.i, &edge});
  }
  // Turning errs by yaw alone: the axis is the vertical, seen from the later body. A trace of the others keeps the
  // covariance definite.
  const auto motionOf = [this](const Step& step) {
    const RelativePoseEdge& edge = *step.edge;
    const Eigen::Vector3d up = poses_.at(edge.j).rotation().conjugate() * Eigen::Vector3d::UnitZ();
    Matrix6d yaw = Matrix6d::Identity();
    yaw.topLeftCorner<3, 3>() = up * up.transpose() + 1e-6 * Eigen::Matrix3d::Identity();
    RelativeMotion motion;
    motion.T_a_b = edge.T_i_j;
    motion.covariance = yaw * (edge.sqrt_information.transpose() * edge.sqrt_information).inverse() * yaw.transpose();
    return step.to == edge.j ? motion : inverse(motion);
  };
  // Dijkstra by the sum of the variances, a radian counting as a metre.
  using Reached = std::pair<double, KeyframeId>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  std::map<KeyframeId, RelativeMotion> best;
  std::map<KeyframeId, double> cost{{from, 0.0}};
  next.emplace(0.0, from);
  while (!next.empty()) {
    const auto [sum, at] = next.top();
    next.pop();
    if (sum > cost.at(at)) continue;
    if (at == to) break;
    for (const Step& step : steps[at]) {
      const RelativeMotion motion = motionOf(step);
      const double through = sum + motion.covariance.trace();
      const auto there = cost.find(step.to);
      if (there != cost.end() && there->second <= through) continue;
      cost[step.to] = through;
      RelativeMotion& way = best[step.to];
      if (at == from) {
        way = motion;
      } else {
        const RelativeMotion& before = best.at(at);
        way = compose(before, motion);
      }
      next.emplace(through, step.to);
    }
  }
  const auto found = best.find(to);
  if (found == best.end()) return std::nullopt;
  return Eigen::Matrix3d(found->second.covariance.bottomRightCorner<3, 3>());
}

}  // namespace vip_slam
