// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/pose_plane_graph.h"

#include <array>
#include <stdexcept>

#include "../util/union_find.h"
#include "pose_plane_costs.h"

namespace vip_slam {
namespace {

using YawPosition = std::array<double, 4>;  // yaw relative to the start, position
using PlaneVector = std::array<double, 4>;  // n, d

}  // namespace

void PosePlaneGraph::addEdge(const RelativePoseEdge& edge) {
  if (!poses_.count(edge.i) || !poses_.count(edge.j) || edge.i == edge.j)
    throw std::invalid_argument("pose graph: edge between keyframes " + std::to_string(edge.i) + " and " +
                                std::to_string(edge.j) + ", expected two known ones");
  relative_.push_back(edge);
}

void PosePlaneGraph::addEdge(const PosePlaneEdge& edge) {
  if (!poses_.count(edge.i) || !planes_.count(edge.plane))
    throw std::invalid_argument("pose graph: edge between keyframe " + std::to_string(edge.i) + " and plane " +
                                std::to_string(edge.plane) + ", expected known ones");
  pose_plane_.push_back(edge);
}

PosePlaneSolution PosePlaneGraph::solve(int max_iterations) const {
  PosePlaneSolution solution;
  if (poses_.empty()) return solution;
  std::map<KeyframeId, YawPosition> x;
  std::map<PlaneId, PlaneVector> y;
  std::map<KeyframeId, int> pose_part;
  std::map<PlaneId, int> plane_part;
  UnionFind parts(static_cast<int>(poses_.size() + planes_.size()));
  int next = 0;
  for (const auto& p : poses_) {
    x[p.first] = {0, p.second.t().x(), p.second.t().y(), p.second.t().z()};
    pose_part[p.first] = next++;
  }
  for (const auto& p : planes_) {
    y[p.first] = {p.second.n.x(), p.second.n.y(), p.second.n.z(), p.second.d};
    plane_part[p.first] = next++;
  }

  ceres::Problem problem;
  for (const RelativePoseEdge& e : relative_) {
    ceres::CostFunction* cost = makeEdgeCost(e, poses_.at(e.i).rotation(), poses_.at(e.j).rotation());
    problem.AddResidualBlock(cost, nullptr, x[e.i].data(), x[e.j].data());
    parts.join(pose_part[e.i], pose_part[e.j]);
  }
  for (const PosePlaneEdge& e : pose_plane_) {
    problem.AddResidualBlock(makeEdgeCost(e, poses_.at(e.i).rotation()), nullptr, x[e.i].data(), y[e.plane].data());
    parts.join(pose_part[e.i], plane_part[e.plane]);
  }
  for (auto& p : y)
    if (problem.HasParameterBlock(p.second.data())) setManifold(&problem, p.second.data(), makePlaneManifold());
  // Keyframes come first in `parts`, so a part's root is its lowest keyframe.
  for (auto& p : x)
    if (problem.HasParameterBlock(p.second.data()) && parts.find(pose_part[p.first]) == pose_part[p.first])
      problem.SetParameterBlockConstant(p.second.data());

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-8;
  ceres::Solver::Summary summary;
  if (problem.NumResidualBlocks() > 0) {
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) return solution;
    solution.iterations = static_cast<int>(summary.iterations.size());
    solution.chi2 = 2.0 * summary.final_cost;
  }
  for (const auto& p : x) solution.T_W_I[p.first] = poseAt(poses_.at(p.first).rotation(), p.second.data());
  for (const auto& p : y)
    solution.planes[p.first] = Plane(Eigen::Vector3d(p.second[0], p.second[1], p.second[2]), p.second[3]);
  solution.usable = true;
  return solution;
}

}  // namespace vip_slam
