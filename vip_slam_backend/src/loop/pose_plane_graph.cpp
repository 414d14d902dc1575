#include "vip_slam_backend/loop/pose_plane_graph.h"

#include <array>
#include <stdexcept>

#include <ceres/ceres.h>

#include "../util/union_find.h"
#include "vip_slam_backend/factors/pose_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"

namespace vip_slam {
namespace {

using YawPosition = std::array<double, 4>;  // yaw relative to the start, position
using PlaneVector = std::array<double, 4>;  // n, d

SE3 poseOf(const Eigen::Quaterniond& R_0, const double* x) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(x[0], Eigen::Vector3d::UnitZ())) * R_0,
             Eigen::Vector3d(x[1], x[2], x[3]));
}

// d(perturbation)/d(yaw, position): Exp(yaw z) R = R Exp(R^T z yaw).
template <int Rows>
Eigen::Matrix<double, Rows, 4> held(const Eigen::Matrix<double, Rows, 6>& J, const SE3& T) {
  Eigen::Matrix<double, Rows, 4> H;
  H.col(0) = J.template leftCols<3>() * (T.rotation().conjugate() * Eigen::Vector3d::UnitZ());
  H.template rightCols<3>() = J.template rightCols<3>();
  return H;
}

template <int Rows>
void store(const Eigen::Matrix<double, Rows, 4>& J, double* out) {
  Eigen::Map<Eigen::Matrix<double, Rows, 4, Eigen::RowMajor>> jacobian(out);
  jacobian = J;
}

class RelativeCost : public ceres::SizedCostFunction<6, 4, 4> {
 public:
  RelativeCost(const RelativePoseEdge& edge, const Eigen::Quaterniond& R_i, const Eigen::Quaterniond& R_j)
      : edge_(edge), R_i_(R_i), R_j_(R_j) {}
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T_i = poseOf(R_i_, x[0]), T_j = poseOf(R_j_, x[1]);
    Matrix6d J_i, J_j;
    Eigen::Map<Vector6d> r(residuals);
    r = edge_.sqrt_information * relativePoseResidual(T_i, T_j, edge_.T_i_j, &J_i, &J_j);
    if (jacobians && jacobians[0]) store<6>(edge_.sqrt_information * held<6>(J_i, T_i), jacobians[0]);
    if (jacobians && jacobians[1]) store<6>(edge_.sqrt_information * held<6>(J_j, T_j), jacobians[1]);
    return true;
  }

 private:
  RelativePoseEdge edge_;
  Eigen::Quaterniond R_i_, R_j_;
};

class PosePlaneCost : public ceres::SizedCostFunction<3, 4, 4> {
 public:
  PosePlaneCost(const PosePlaneEdge& edge, const Eigen::Quaterniond& R) : edge_(edge), R_(R) {}
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const SE3 T = poseOf(R_, x[0]);
    const Plane plane(Eigen::Vector3d(x[1][0], x[1][1], x[1][2]), x[1][3]);
    Eigen::Matrix<double, 3, 6> J_pose;
    Eigen::Matrix3d J_plane;
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r = edge_.sqrt_information * posePlaneResidual(T, plane, edge_.measured_I, &J_pose, &J_plane);
    if (jacobians && jacobians[0]) store<3>(edge_.sqrt_information * held<3>(J_pose, T), jacobians[0]);
    if (jacobians && jacobians[1]) {
      // From the factor's tangent basis to the ambient (n, d), which the manifold projects to its own tangent.
      Eigen::Matrix<double, 3, 4> to_tangent = Eigen::Matrix<double, 3, 4>::Zero();
      to_tangent.topLeftCorner<2, 3>() = tangentBasis(plane.n).transpose();
      to_tangent(2, 3) = 1;
      store<3>(edge_.sqrt_information * J_plane * to_tangent, jacobians[1]);
    }
    return true;
  }

 private:
  PosePlaneEdge edge_;
  Eigen::Quaterniond R_;
};

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
    auto* cost = new RelativeCost(e, poses_.at(e.i).rotation(), poses_.at(e.j).rotation());
    problem.AddResidualBlock(cost, nullptr, x[e.i].data(), x[e.j].data());
    parts.join(pose_part[e.i], pose_part[e.j]);
  }
  for (const PosePlaneEdge& e : pose_plane_) {
    problem.AddResidualBlock(new PosePlaneCost(e, poses_.at(e.i).rotation()), nullptr, x[e.i].data(),
                             y[e.plane].data());
    parts.join(pose_part[e.i], plane_part[e.plane]);
  }
  for (auto& p : y)
    if (problem.HasParameterBlock(p.second.data()))
      problem.SetManifold(p.second.data(),
                          new ceres::ProductManifold<ceres::SphereManifold<3>, ceres::EuclideanManifold<1>>);
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
  for (const auto& p : x) solution.T_W_I[p.first] = poseOf(poses_.at(p.first).rotation(), p.second.data());
  for (const auto& p : y)
    solution.planes[p.first] = Plane(Eigen::Vector3d(p.second[0], p.second[1], p.second[2]), p.second[3]);
  solution.usable = true;
  return solution;
}

}  // namespace vip_slam
