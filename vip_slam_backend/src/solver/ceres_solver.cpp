// SPDX-License-Identifier: BSD-3-Clause
#include "ceres_solver.h"

#include <chrono>
#include <stdexcept>

#include "ceres_factors.h"

namespace vip_slam {
namespace {

// The problem's variables as Ceres parameter blocks.
struct Blocks {
  std::vector<std::array<double, 7>> poses;
  std::vector<std::array<double, 9>> motions;
  std::vector<std::array<double, 4>> planes;

  explicit Blocks(const BaProblem& problem) {
    for (const BaFrame& f : problem.frames) {
      const Eigen::Vector4d q = f.state.T_W_I.rotation().coeffs();
      const Eigen::Vector3d& t = f.state.T_W_I.t();
      poses.push_back({q(0), q(1), q(2), q(3), t(0), t(1), t(2)});
      std::array<double, 9> m;
      Eigen::Map<Eigen::Matrix<double, 9, 1>>(m.data()) << f.state.v_W, f.state.bias_gyro, f.state.bias_accel;
      motions.push_back(m);
    }
    for (const BaPlane& p : problem.planes) planes.push_back({p.plane.n(0), p.plane.n(1), p.plane.n(2), p.plane.d});
  }

  void store(BaProblem* problem) const {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      NavState& s = problem->frames[k].state;
      if (problem->frames[k].fixed) continue;
      s.T_W_I = poseOf(poses[k].data());
      s.v_W = Eigen::Map<const Eigen::Vector3d>(motions[k].data());
      s.bias_gyro = Eigen::Map<const Eigen::Vector3d>(motions[k].data() + 3);
      s.bias_accel = Eigen::Map<const Eigen::Vector3d>(motions[k].data() + 6);
    }
    for (std::size_t k = 0; k < planes.size(); ++k)
      problem->planes[k].plane = Plane(Eigen::Vector3d(planes[k][0], planes[k][1], planes[k][2]), planes[k][3]);
  }
};

// Points are optimised in place; everything else goes through `b`.
void build(BaProblem& problem, Blocks& b, ceres::Problem* out, ceres::ParameterBlockOrdering* ordering) {
  auto* pose_manifold = new PoseManifold;
  auto* plane_manifold = new PlaneManifold;
  const auto poseBlock = [&](int f) { return b.poses[f].data(); };
  const auto motionBlock = [&](int f) { return b.motions[f].data(); };
  // Blocks in a fixed order; the manifold passes to the problem with the first block that uses it.
  bool pose_used = false;
  for (std::size_t k = 0; k < problem.frames.size(); ++k) {
    out->AddParameterBlock(poseBlock(k), 7, pose_manifold);
    pose_used = true;
    if (problem.frames[k].fixed) out->SetParameterBlockConstant(poseBlock(k));
  }
  for (std::size_t k = 0; k < problem.frames.size(); ++k) {
    out->AddParameterBlock(motionBlock(k), 9);
    if (problem.frames[k].fixed || !problem.frames[k].motion) out->SetParameterBlockConstant(motionBlock(k));
  }
  bool plane_used = false;
  for (auto& plane : b.planes) {
    out->AddParameterBlock(plane.data(), 4, plane_manifold);
    plane_used = true;
  }
  if (!pose_used) delete pose_manifold;
  if (!plane_used) delete plane_manifold;

  ceres::LossFunction* pixel_loss = problem.huber > 0 ? new ceres::HuberLoss(problem.huber) : nullptr;
  ceres::LossFunction* depth_loss = problem.depth_huber > 0 ? new ceres::HuberLoss(problem.depth_huber) : nullptr;
  bool pixel_loss_used = false, depth_loss_used = false;
  const bool plain = !pixel_loss && !depth_loss;
  for (BaPoint& p : problem.points) {
    double* point = p.p_W.data();
    out->AddParameterBlock(point, 3);
    for (int o = p.first; o < p.first + p.count; ++o) {
      const BaObservation& obs = problem.observations[o];
      const SE3& T_I_C = problem.frames[obs.frame].T_I_C;
      const bool depth = obs.depth_weight > 0;
      out->AddResidualBlock(makeReprojectionCost(T_I_C, obs, depth && plain), pixel_loss, poseBlock(obs.frame), point);
      pixel_loss_used = true;
      if (depth && !plain) {
        out->AddResidualBlock(makeDepthCost(T_I_C, obs), depth_loss, poseBlock(obs.frame), point);
        depth_loss_used = true;
      }
    }
  }
  if (!pixel_loss_used) delete pixel_loss;
  if (!depth_loss_used) delete depth_loss;
  for (const BaImu& f : problem.imu)
    out->AddResidualBlock(makeImuCost(f.preintegration, problem.gravity), nullptr, poseBlock(f.i), motionBlock(f.i),
                          poseBlock(f.j), motionBlock(f.j));
  for (const BaHomography& f : problem.homographies)
    out->AddResidualBlock(
        makeHomographyCost(problem.frames[f.i].T_I_C, problem.frames[f.j].T_I_C, homographyMatrix(f.sums)), nullptr,
        poseBlock(f.i), poseBlock(f.j), b.planes[f.plane].data());
  for (const BaHomographyPair& f : problem.homography_pairs)
    out->AddResidualBlock(makeHomographyPairCost(problem.frames[f.i].T_I_C, problem.frames[f.j].T_I_C, f.pair), nullptr,
                          poseBlock(f.i), poseBlock(f.j), b.planes[f.plane].data());
  for (const BaPointToPlane& f : problem.point_to_plane)
    out->AddResidualBlock(makePointToPlaneCost(problem.frames[f.frame].T_I_C, f.G), nullptr, poseBlock(f.frame),
                          b.planes[f.plane].data());
  for (const BaPlaneSample& f : problem.plane_samples)
    out->AddResidualBlock(makePlaneSampleCost(problem.frames[f.frame].T_I_C, f.p_C, f.weight), nullptr,
                          poseBlock(f.frame), b.planes[f.plane].data());
  for (std::size_t p = 0; p < problem.planes.size(); ++p)
    if (problem.planes[p].prior_weight > 0 && problem.planes[p].kind != PlaneKind::kGeneral)
      out->AddResidualBlock(makePlanePriorCost(problem.planes[p].kind, problem.planes[p].prior_weight), nullptr,
                            b.planes[p].data());
  for (const BaRelativePose& f : problem.relative_poses)
    out->AddResidualBlock(makeRelativePoseCost(f), nullptr, poseBlock(f.i), poseBlock(f.j));
  for (const BaGauge& f : problem.gauges) out->AddResidualBlock(makeGaugeCost(f.prior), nullptr, poseBlock(f.frame));
  for (const BaMotionPrior& f : problem.motion_priors)
    out->AddResidualBlock(makeMotionPriorCost(f.prior), nullptr, motionBlock(f.frame));

  if (ordering) {
    for (std::size_t k = 0; k < problem.frames.size(); ++k) {
      ordering->AddElementToGroup(poseBlock(k), 1);
      ordering->AddElementToGroup(motionBlock(k), 1);
    }
    for (auto& plane : b.planes) ordering->AddElementToGroup(plane.data(), 1);
    for (BaPoint& p : problem.points) ordering->AddElementToGroup(p.p_W.data(), 0);
  }
}

}  // namespace

SolverSummary CeresSolver::solve(BaProblem& problem, const SolverOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const std::string bad = validateProblem(problem);
  if (!bad.empty()) throw std::invalid_argument("bundle adjustment: " + bad);
  SolverSummary summary;
  summary.residual_blocks = problem.residualBlocks();
  summary.parameters = problem.parameters();
  summary.observations = problem.observations.size();
  Blocks blocks(problem);
  ceres::Problem ceres_problem;
  ceres::Solver::Options o;
  o.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  build(problem, blocks, &ceres_problem, o.linear_solver_ordering.get());
  if (problem.points.empty()) o.linear_solver_ordering.reset();
  o.linear_solver_type = problem.points.empty() ? ceres::SPARSE_NORMAL_CHOLESKY : ceres::SPARSE_SCHUR;
  o.max_num_iterations = options.max_iterations;
  if (options.max_seconds > 0) o.max_solver_time_in_seconds = options.max_seconds;
  o.num_threads = options.threads;
  o.initial_trust_region_radius = options.initial_radius;
  o.function_tolerance = options.keep_iterating ? 0 : options.function_tolerance;
  o.gradient_tolerance = options.keep_iterating ? 0 : options.gradient_tolerance;
  o.parameter_tolerance = options.keep_iterating ? 0 : options.parameter_tolerance;
  o.jacobi_scaling = false;
  o.logging_type = ceres::SILENT;
  const auto built = std::chrono::steady_clock::now();
  ceres::Solver::Summary s;
  ceres::Solve(o, &ceres_problem, &s);
  blocks.store(&problem);
  summary.initial_cost = s.initial_cost;
  summary.final_cost = s.final_cost;
  summary.iterations = static_cast<int>(s.iterations.size()) - 1;
  summary.usable = s.IsSolutionUsable();
  summary.message = s.message;
  summary.residual_ms = 1e3 * s.residual_evaluation_time_in_seconds;
  summary.jacobian_ms = 1e3 * s.jacobian_evaluation_time_in_seconds;
  summary.linear_ms = 1e3 * s.linear_solver_time_in_seconds;
  summary.preprocess_ms =
      1e3 * s.preprocessor_time_in_seconds + std::chrono::duration<double, std::milli>(built - start).count();
  summary.postprocess_ms = 1e3 * s.postprocessor_time_in_seconds;
  for (std::size_t k = 1; k < s.iterations.size(); ++k) {
    SolverIteration log;
    log.cost = s.iterations[k].cost;
    log.radius = s.iterations[k - 1].trust_region_radius;  // Ceres gives that after the step
    log.step_norm = s.iterations[k].step_norm;
    log.accepted = s.iterations[k].step_is_successful;
    summary.log.push_back(log);
  }
  summary.total_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

void ceresNormalEquations(BaProblem& problem, Eigen::MatrixXd* JtJ, Eigen::VectorXd* Jtr) {
  Blocks blocks(problem);
  ceres::Problem ceres_problem;
  build(problem, blocks, &ceres_problem, nullptr);
  ceres::Problem::EvaluateOptions options;
  for (std::size_t k = 0; k < problem.frames.size(); ++k)
    if (!problem.frames[k].fixed) options.parameter_blocks.push_back(blocks.poses[k].data());
  for (std::size_t k = 0; k < problem.frames.size(); ++k)
    if (!problem.frames[k].fixed && problem.frames[k].motion)
      options.parameter_blocks.push_back(blocks.motions[k].data());
  for (auto& plane : blocks.planes) options.parameter_blocks.push_back(plane.data());
  for (BaPoint& p : problem.points) options.parameter_blocks.push_back(p.p_W.data());
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  ceres_problem.Evaluate(options, nullptr, &residuals, nullptr, &crs);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
  for (int r = 0; r < crs.num_rows; ++r)
    for (int k = crs.rows[r]; k < crs.rows[r + 1]; ++k) J(r, crs.cols[k]) = crs.values[k];
  *JtJ = J.transpose() * J;
  *Jtr = J.transpose() * Eigen::Map<Eigen::VectorXd>(residuals.data(), residuals.size());
}

}  // namespace vip_slam
