#include "structured_solver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>

namespace vip_slam {
namespace {

using Clock = std::chrono::steady_clock;
double ms(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

constexpr double kMinDiagonal = 1e-6, kMaxDiagonal = 1e32, kMaxRadius = 1e16, kMinRadius = 1e-32, kMinRatio = 1e-3;

void copyRowMajor(const Eigen::Matrix3d& M, double* out) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out, 3, 3) = M;
}

}  // namespace

void StructuredSolver::prepare(const BaProblem& problem) {
  structure_.update(problem);
  const SparseCholesky& cholesky = structure_.cholesky;
  observations_.resize(problem.observations.size());
  for (std::size_t o = 0; o < observations_.size(); ++o) observations_[o] = problem.observations[structure_.sorted[o]];
  values_.resize(cholesky.valueCount() + 8);
  for (auto* v : {&gradient_, &full_gradient_, &diagonal_, &damping_, &step_}) v->assign(cholesky.dimension(), 0.0);
  W_.resize(24 * observations_.size());
  points_.resize(3 * problem.points.size());
  point_step_.resize(points_.size());
  point_gradient_.resize(points_.size());
  point_damping_.resize(points_.size());
  point_inverse_.resize(2 * points_.size());
  homographies_.resize(problem.homographies.size());
  homography_G_.resize(problem.homographies.size());
  for (std::size_t k = 0; k < homographies_.size(); ++k) {
    const BaHomography& f = problem.homographies[k];
    const SystemStructure::TriplePlaces& place = structure_.homographies[k];
    homographies_[k] = {f.i, f.j, f.plane, place.ji.transposed, place.pi.transposed, place.pj.transposed,
                        place.ji.offset, place.pi.offset, place.pj.offset};
    homography_G_[k] = f.G.data();
  }
  int longest = 1;
  for (const BaPoint& p : problem.points) longest = std::max(longest, p.count);
  scratch_.resize(24 * static_cast<std::size_t>(longest));
}

void StructuredSolver::loadFrames(const BaProblem& problem) {
  frames_.resize(problem.frames.size());
  geometry_.resize(problem.frames.size());
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    const BaFrame& f = problem.frames[k];
    FrameGeometry& g = geometry_[k];
    g = FrameGeometry(f.state.T_W_I, f.T_I_C);
    KernelFrame& out = frames_[k];
    copyRowMajor(g.R_C_W, out.R_C_W);
    copyRowMajor(g.R_C_I, out.R_C_I);
    copyRowMajor(g.R_W_I, out.R_W_I);
    Eigen::Map<Eigen::Vector3d>(out.t_W_I) = g.t_W_I;
    Eigen::Map<Eigen::Vector3d>(out.t_W_C) = g.t_W_C;
    Eigen::Map<Eigen::Vector3d>(out.t_I_C) = g.t_I_C;
    Eigen::Map<Eigen::Vector3d>(out.offset_C) = g.R_C_I * g.t_I_C;
    const int node = structure_.pose_node[k];
    out.diagonal = node < 0 ? -1 : static_cast<std::int64_t>(structure_.cholesky.diagonalOffset(node));
    out.unknown = node < 0 ? 0 : structure_.cholesky.unknown(node);
  }
  for (std::size_t k = 0; k < problem.points.size(); ++k)
    Eigen::Map<Eigen::Vector3d>(points_.data() + 3 * k) = problem.points[k].p_W;
  basis_.resize(problem.planes.size());
  planes_.resize(problem.planes.size());
  for (std::size_t k = 0; k < basis_.size(); ++k) {
    const Plane& plane = problem.planes[k].plane;
    basis_[k] = tangentBasis(plane.n);
    KernelPlane& out = planes_[k];
    Eigen::Map<Eigen::Vector3d>(out.n) = plane.n;
    out.d = plane.d;
    Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(out.basis) = basis_[k];
    const int node = structure_.plane_node[k];
    out.diagonal = static_cast<std::int64_t>(structure_.cholesky.diagonalOffset(node));
    out.unknown = structure_.cholesky.unknown(node);
  }
}

HomographyKernelArguments StructuredSolver::homographyArguments() const {
  HomographyKernelArguments a;
  a.frames = frames_.data();
  a.planes = planes_.data();
  a.factors = homographies_.data();
  a.G = homography_G_.data();
  return a;
}

PointKernelArguments StructuredSolver::arguments(const BaProblem& problem, double radius) {
  PointKernelArguments a;
  a.frames = frames_.data();
  a.frame_count = static_cast<int>(frames_.size());
  a.observations = observations_.data();
  a.first = structure_.first.data();
  a.points = points_.data();
  a.pair_offset = structure_.pair_offset.data();
  a.huber = problem.huber;
  a.depth_huber = problem.depth_huber;
  a.inverse_radius = 1.0 / radius;
  a.values = values_.data();
  a.gradient = gradient_.data();
  a.full_gradient = full_gradient_.data();
  a.diagonal = diagonal_.data();
  a.W = W_.data();
  a.point_inverse = point_inverse_.data();
  a.point_gradient = point_gradient_.data();
  a.point_damping = point_damping_.data();
  return a;
}

double StructuredSolver::cost(const BaProblem& problem) {
  loadFrames(problem);
  const int points = static_cast<int>(problem.points.size());
  return 0.5 * (pointKernels().cost(arguments(problem, 1), 0, points) + factorCost(problem));
}

void StructuredSolver::linearize(const BaProblem& problem, double radius, int threads) {
  loadFrames(problem);
  std::fill(values_.begin(), values_.end(), 0.0);
  for (auto* v : {&gradient_, &full_gradient_, &diagonal_}) std::fill(v->begin(), v->end(), 0.0);
  const PointKernelArguments a = arguments(problem, radius);
  const int points = static_cast<int>(problem.points.size());
  if (threads > 1 && points > 100) {
    // The second thread takes the second half of the observations into sums of its own.
    const int half = static_cast<int>(observations_.size() / 2);
    const int split = static_cast<int>(
        std::lower_bound(structure_.first.begin(), structure_.first.end() - 1, half) - structure_.first.begin());
    values2_.assign(values_.size(), 0.0);
    for (auto* v : {&gradient2_, &full_gradient2_, &diagonal2_}) v->assign(gradient_.size(), 0.0);
    scratch2_.resize(scratch_.size());
    PointKernelArguments b = a;
    b.values = values2_.data();
    b.gradient = gradient2_.data();
    b.full_gradient = full_gradient2_.data();
    b.diagonal = diagonal2_.data();
    std::thread second([&] { pointKernels().linearize(b, split, points, scratch2_.data()); });
    pointKernels().linearize(a, 0, split, scratch_.data());
    linearizeImu(problem);
    linearizePlanes(problem);
    second.join();
    for (std::size_t k = 0; k < values_.size(); ++k) values_[k] += values2_[k];
    for (std::size_t k = 0; k < gradient_.size(); ++k) {
      gradient_[k] += gradient2_[k];
      full_gradient_[k] += full_gradient2_[k];
      diagonal_[k] += diagonal2_[k];
    }
  } else {
    pointKernels().linearize(a, 0, points, scratch_.data());
    linearizeImu(problem);
    linearizePlanes(problem);
  }
  linearizePriors(problem);
  const SparseCholesky& cholesky = structure_.cholesky;
  for (const auto* nodes : {&structure_.pose_node, &structure_.motion_node, &structure_.plane_node})
    for (const int node : *nodes) {
      if (node < 0) continue;
      const int size = nodes == &structure_.pose_node ? 6 : nodes == &structure_.motion_node ? 9 : 3;
      const int u = cholesky.unknown(node), ld = SparseCholesky::leading(size);
      double* block = values_.data() + cholesky.diagonalOffset(node);
      for (int k = 0; k < size; ++k) {
        damping_[u + k] = std::clamp(diagonal_[u + k], kMinDiagonal, kMaxDiagonal) / radius;
        block[k * ld + k] += damping_[u + k];
      }
    }
}

bool StructuredSolver::solveStep() {
  if (!structure_.cholesky.factorize(values_.data())) return false;
  for (std::size_t k = 0; k < step_.size(); ++k) step_[k] = -gradient_[k];
  structure_.cholesky.solve(step_.data());
  PointKernelArguments a;
  a.frames = frames_.data();
  a.observations = observations_.data();
  a.first = structure_.first.data();
  a.W = W_.data();
  a.point_inverse = point_inverse_.data();
  a.point_gradient = point_gradient_.data();
  pointKernels().backSubstitute(a, step_.data(), point_step_.data(), 0, static_cast<int>(points_.size() / 3));
  for (const double v : step_)
    if (!std::isfinite(v)) return false;
  return true;
}

double StructuredSolver::modelDecrease() const {
  double sum = 0;
  for (std::size_t k = 0; k < step_.size(); ++k)
    sum += step_[k] * (damping_[k] * step_[k] - full_gradient_[k]);
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
  for (std::size_t k = 0; k < from.points.size(); ++k)
    to->points[k].p_W = from.points[k].p_W + Eigen::Map<const Eigen::Vector3d>(point_step_.data() + 3 * k);
}

StructuredSolver::Step StructuredSolver::stepAt(const BaProblem& problem, double radius) {
  prepare(problem);
  linearize(problem, radius, 1);
  if (!solveStep()) throw std::runtime_error("structured solver: normal equations are not positive definite");
  const auto copy = [](const std::vector<double>& v) { return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(v.data(), v.size())); };
  return {copy(full_gradient_), copy(diagonal_), copy(step_), copy(point_step_)};
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
  summary.factor_nonzeros = structure_.cholesky.factorNonzeros();
  State other{problem.frames, problem.points, problem.planes};
  const auto exchange = [&] {
    std::swap(problem.frames, other.frames);
    std::swap(problem.points, other.points);
    std::swap(problem.planes, other.planes);
  };
  auto mark = Clock::now();
  summary.preprocess_ms = ms(start, mark);
  double present = cost(problem);
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
    linearize(problem, radius, options.threads);
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
    const bool solved = solveStep();
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
      const double trial = cost(problem);
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
  mark = Clock::now();
  summary.final_cost = present;
  const auto end = Clock::now();
  summary.postprocess_ms = ms(mark, end);
  summary.total_ms = ms(start, end);
  return summary;
}

}  // namespace vip_slam
