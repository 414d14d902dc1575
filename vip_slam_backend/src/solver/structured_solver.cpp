// SPDX-License-Identifier: BSD-3-Clause
#include "structured_solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace vip_slam {
namespace {

using Clock = std::chrono::steady_clock;
double ms(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

}  // namespace

double StructuredSolver::cost(const BaProblem& problem, bool ahead, Worker* worker) {
  loadFrames(problem);
  const PointKernelArguments a = arguments(problem, 1);
  const auto start = Clock::now();
  double parts[1 + SystemStructure::kPointParts];
  worker->share(1 + SystemStructure::kPointParts, [&](int piece) {
    const int part = piece - 1;
    if (piece == 0)
      parts[piece] = ahead ? linearizeFactors(problem) : factorCost(problem);
    else
      parts[piece] =
          ahead ? linearizePoints(a, part)
                : pointKernels(instruction_set_).cost(a, structure_.part_begin[part], structure_.part_begin[part + 1]);
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
  worker->share(SystemStructure::kRanges, [&](int piece) {
    pointKernels(instruction_set_)
        .backSubstitute(a, step_.data(), point_step_.data(), points * piece / SystemStructure::kRanges,
                        points * (piece + 1) / SystemStructure::kRanges);
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
  // From the order of processing to the problem's.
  const auto ofPoints = [this](const std::vector<double>& v) {
    Eigen::VectorXd out(v.size());
    for (std::size_t k = 0; k < structure_.point_at.size(); ++k)
      out.segment<3>(3 * structure_.point_at[k]) = Eigen::Map<const Eigen::Vector3d>(v.data() + 3 * k);
    return out;
  };
  return {copy(full_gradient_), copy(diagonal_), copy(step_), ofPoints(point_gradient_), ofPoints(point_step_)};
}

void StructuredSolver::TrustRegion::accept(double ratio) {
  radius /= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
  decrease_factor = 2;
}

bool StructuredSolver::TrustRegion::refuse() {
  radius /= decrease_factor;
  decrease_factor *= 2;
  // With a smaller one the step vanishes in the rounding of the states.
  return radius >= std::numeric_limits<double>::epsilon();
}

double StructuredSolver::largestGradient() const {
  double largest = 0;
  for (const double g : full_gradient_) largest = std::max(largest, std::abs(g));
  for (const double g : point_gradient_) largest = std::max(largest, std::abs(g));
  return largest;
}

StructuredSolver::Trial StructuredSolver::tryStep(BaProblem& problem, const SolverOptions& options, bool last,
                                                  double present, State* other) {
  const auto exchange = [&] {
    std::swap(problem.frames, other->frames);
    std::swap(problem.points, other->points);
    std::swap(problem.planes, other->planes);
  };
  Trial trial;
  const double predicted = modelDecrease();
  if (!(predicted > 0)) return trial;
  trial.step_norm = stepNorm();
  apply(problem, other);
  exchange();
  const bool goes_on = !last && (options.keep_iterating || predicted > options.function_tolerance * present);
  trial.cost = cost(problem, goes_on, worker_.get());
  const double decrease = present - trial.cost;
  trial.ratio = decrease / predicted;
  const double least = options.function_tolerance * present;
  trial.accepted = std::isfinite(trial.cost) && trial.ratio > 0;
  if (trial.accepted) {
    trial.converged = decrease <= least || trial.step_norm < options.parameter_tolerance;
  } else {
    exchange();
    loaded_ = false;
    // Converged when even a rejected step hardly changes the cost.
    trial.converged = std::isfinite(trial.cost) && std::abs(decrease) <= least;
  }
  return trial;
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
  summary.factor_size = structure_.cholesky.factorSize();
  ahead_ms_ = 0;
  State other{problem.frames, problem.points, problem.planes};
  // Adds the time since the last call to one part of the summary.
  auto mark = Clock::now();
  summary.preprocess_ms = ms(start, mark);
  const auto spent = [&mark](double* part) {
    const auto now = Clock::now();
    *part += ms(mark, now);
    mark = now;
  };
  // The helper thread is kept between solves: joining it on a busy machine takes as long as a small solve.
  if (!worker_ || helper_ != (options.threads > 1)) {
    helper_ = options.threads > 1;
    worker_ = std::make_unique<Worker>(helper_);
  }
  double present = cost(problem, options.max_iterations > 0, worker_.get());
  spent(&summary.residual_ms);
  summary.initial_cost = summary.final_cost = present;
  if (!std::isfinite(present)) {
    summary.usable = false;
    summary.message = "the initial cost is not finite";
    return summary;
  }
  TrustRegion region{options.initial_radius};
  summary.message = "iterations used up";
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (options.max_seconds > 0 && ms(start, Clock::now()) > 1e3 * options.max_seconds) {
      summary.message = "time used up";
      break;
    }
    linearize(problem, region.radius, worker_.get());
    spent(&summary.jacobian_ms);
    if (!options.keep_iterating && largestGradient() < options.gradient_tolerance) {
      summary.message = "gradient vanished";
      break;
    }
    const bool solved = solveStep(problem, region.radius, worker_.get());
    spent(&summary.linear_ms);
    ++summary.iterations;
    Trial trial;
    if (solved) trial = tryStep(problem, options, iteration + 1 == options.max_iterations, present, &other);
    spent(&summary.residual_ms);
    summary.log.push_back({trial.cost, region.radius, trial.step_norm, trial.accepted});
    if (trial.accepted) {
      present = trial.cost;
      region.accept(trial.ratio);
    } else if (!region.refuse()) {
      summary.message = "trust region vanished";
      break;
    }
    if (trial.converged && !options.keep_iterating) {
      summary.message = "converged";
      break;
    }
  }
  summary.residual_ms -= ahead_ms_;
  summary.jacobian_ms += ahead_ms_;
  summary.final_cost = present;
  summary.total_ms = ms(start, Clock::now());
  return summary;
}

}  // namespace vip_slam
