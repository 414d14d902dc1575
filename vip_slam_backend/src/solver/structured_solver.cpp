#include "structured_solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace vip_slam {
namespace {

using Clock = std::chrono::steady_clock;
double ms(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

constexpr double kMaxRadius = 1e16, kMinRadius = 1e-32, kMinRatio = 1e-3;

}  // namespace

double StructuredSolver::cost(const BaProblem& problem, bool ahead, Worker* worker) {
  loadFrames(problem);
  const PointKernelArguments a = arguments(problem, 1);
  const auto start = Clock::now();
  double parts[1 + kPointParts];
  worker->share(1 + kPointParts, [&](int piece) {
    const int part = piece - 1;
    if (piece == 0)
      parts[piece] = ahead ? linearizeFactors(problem) : factorCost(problem);
    else
      parts[piece] = ahead ? linearizePoints(a, part)
                           : pointKernels().cost(a, structure_.part_begin[part], structure_.part_begin[part + 1]);
  });
  if (ahead) ahead_ms_ += ms(start, Clock::now());
  ahead_ = ahead;
  double sum = 0;
  for (const double part : parts) sum += part;
  return 0.5 * sum;
}

bool StructuredSolver::solveStep(const BaProblem& problem, double radius, Worker* worker) {
  for (std::size_t k = 0; k < step_.size(); ++k) step_[k] = -gradient_[k];
  if (!structure_.cholesky.solve(values_.data(), step_.data(), worker)) return false;
  const PointKernelArguments a = arguments(problem, radius);
  const int points = static_cast<int>(points_.size() / 3);
  constexpr int kPieces = 8;
  worker->share(kPieces, [&](int piece) {
    pointKernels().backSubstitute(a, step_.data(), point_step_.data(), points * piece / kPieces,
                                  points * (piece + 1) / kPieces);
  });
  for (const double v : step_)
    if (!std::isfinite(v)) return false;
  return true;
}

double StructuredSolver::modelDecrease() const {
  double sum = 0;
  for (std::size_t k = 0; k < step_.size(); ++k) sum += step_[k] * (damping_[k] * step_[k] - full_gradient_[k]);
  for (std::size_t k = 0; k < point_step_.size(); ++k)
    sum += point_step_[k] * (point_damping_[k] * point_step_[k] - point_gradient_[k]);
  return 0.5 * sum;
}

double StructuredSolver::stepNorm() const {
  double sum = 0;
  for (const double v : step_) sum += v * v;
  for (const double v : point_step_) sum += v * v;
  return std::sqrt(sum);
}

void StructuredSolver::apply(const BaProblem& from, State* to) const {
  const SparseCholesky& cholesky = structure_.cholesky;
  for (std::size_t k = 0; k < from.frames.size(); ++k) {
    const int pose = structure_.pose_node[k], motion = structure_.motion_node[k];
    if (pose < 0) continue;
    const NavState& s = from.frames[k].state;
    NavState& out = to->frames[k].state;
    out.T_W_I = s.T_W_I.boxplus(Eigen::Map<const Vector6d>(step_.data() + cholesky.unknown(pose)));
    if (motion < 0) continue;
    const double* m = step_.data() + cholesky.unknown(motion);
    out.v_W = s.v_W + Eigen::Map<const Eigen::Vector3d>(m);
    out.bias_gyro = s.bias_gyro + Eigen::Map<const Eigen::Vector3d>(m + 3);
    out.bias_accel = s.bias_accel + Eigen::Map<const Eigen::Vector3d>(m + 6);
  }
  for (std::size_t k = 0; k < from.planes.size(); ++k)
    to->planes[k].plane = from.planes[k].plane.boxplus(
        Eigen::Map<const Eigen::Vector3d>(step_.data() + cholesky.unknown(structure_.plane_node[k])));
  for (std::size_t k = 0; k < from.points.size(); ++k) {
    const int p = structure_.point_at[k];
    to->points[p].p_W = from.points[p].p_W + Eigen::Map<const Eigen::Vector3d>(point_step_.data() + 3 * k);
  }
}

StructuredSolver::Step StructuredSolver::stepAt(const BaProblem& problem, double radius) {
  prepare(problem);
  Worker worker(false);
  linearize(problem, radius, &worker);
  if (!solveStep(problem, radius, &worker))
    throw std::runtime_error("structured solver: normal equations are not positive definite");
  const auto copy = [](const std::vector<double>& v) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(v.data(), v.size()));
  };
  Eigen::VectorXd point_step(point_step_.size());
  for (std::size_t k = 0; k < structure_.point_at.size(); ++k)
    point_step.segment<3>(3 * structure_.point_at[k]) = Eigen::Map<const Eigen::Vector3d>(point_step_.data() + 3 * k);
  return {copy(full_gradient_), copy(diagonal_), copy(step_), point_step};
}

SolverSummary StructuredSolver::solve(BaProblem& problem, const SolverOptions& options) {
  const auto start = Clock::now();
  const std::string bad = validateProblem(problem);
  if (!bad.empty()) throw std::invalid_argument("bundle adjustment: " + bad);
  SolverSummary summary;
  summary.residual_blocks = problem.residualBlocks();
  summary.parameters = problem.parameters();
  summary.observations = problem.observations.size();
  prepare(problem);
  ahead_ms_ = 0;
  summary.factor_nonzeros = structure_.cholesky.factorNonzeros();
  State other{problem.frames, problem.points, problem.planes};
  const auto exchange = [&] {
    std::swap(problem.frames, other.frames);
    std::swap(problem.points, other.points);
    std::swap(problem.planes, other.planes);
  };
  auto mark = Clock::now();
  summary.preprocess_ms = ms(start, mark);
  // The helper outlives the solve: to wait for its end on a busy machine takes as long as a small solve.
  if (!worker_ || helper_ != (options.threads > 1)) {
    helper_ = options.threads > 1;
    worker_ = std::make_unique<Worker>(helper_);
  }
  Worker& worker = *worker_;
  double present = cost(problem, options.max_iterations > 0, &worker);
  summary.residual_ms += ms(mark, Clock::now());
  summary.initial_cost = summary.final_cost = present;
  if (!std::isfinite(present)) {
    summary.usable = false;
    summary.message = "the initial cost is not finite";
    return summary;
  }
  double radius = options.initial_radius, decrease_factor = 2;
  summary.message = "iterations used up";
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (options.max_seconds > 0 && ms(start, Clock::now()) > 1e3 * options.max_seconds) {
      summary.message = "time used up";
      break;
    }
    mark = Clock::now();
    linearize(problem, radius, &worker);
    auto next = Clock::now();
    summary.jacobian_ms += ms(mark, next);
    if (!options.keep_iterating) {
      double largest = 0;
      for (const double g : full_gradient_) largest = std::max(largest, std::abs(g));
      for (const double g : point_gradient_) largest = std::max(largest, std::abs(g));
      if (largest < options.gradient_tolerance) {
        summary.message = "gradient vanished";
        break;
      }
    }
    mark = next;
    const bool solved = solveStep(problem, radius, &worker);
    next = Clock::now();
    summary.linear_ms += ms(mark, next);
    ++summary.iterations;
    SolverIteration log;
    log.radius = radius;
    const double predicted = solved ? modelDecrease() : 0;
    bool accepted = false, converged = false;
    if (predicted > 0) {
      mark = next;
      log.step_norm = stepNorm();
      apply(problem, &other);
      exchange();
      const bool goes_on = iteration + 1 < options.max_iterations &&
                           (options.keep_iterating || predicted > options.function_tolerance * present);
      const double trial = cost(problem, goes_on, &worker);
      summary.residual_ms += ms(mark, Clock::now());
      const double decrease = present - trial, ratio = decrease / predicted;
      log.cost = trial;
      if (std::isfinite(trial) && ratio > kMinRatio) {
        accepted = true;
        converged = decrease <= options.function_tolerance * present || log.step_norm < options.parameter_tolerance;
        present = trial;
        radius = std::min(kMaxRadius, radius / std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3)));
        decrease_factor = 2;
      } else {
        exchange();
        loaded_ = false;
        // No step of this length helps any more.
        converged = std::isfinite(trial) && std::abs(decrease) <= options.function_tolerance * present;
      }
    }
    log.accepted = accepted;
    summary.log.push_back(log);
    if (!accepted) {
      radius /= decrease_factor;
      decrease_factor *= 2;
      if (radius < kMinRadius) {
        summary.message = "trust region vanished";
        break;
      }
    }
    if (converged && !options.keep_iterating) {
      summary.message = "converged";
      break;
    }
  }
  summary.residual_ms -= ahead_ms_;
  summary.jacobian_ms += ahead_ms_;
  mark = Clock::now();
  summary.final_cost = present;
  const auto end = Clock::now();
  summary.postprocess_ms = ms(mark, end);
  summary.total_ms = ms(start, end);
  return summary;
}

}  // namespace vip_slam
