// The normal equations of the structured solver: factors among poses, motions and planes, points, elimination of the
// points.
#include <algorithm>

#include "structured_solver.h"

namespace vip_slam {
namespace {

constexpr double kMinDiagonal = 1e-6, kMaxDiagonal = 1e32;

}  // namespace

// Whatever the number of threads, each number of the result is the same sum in the same order: what a thread adds to is
// either its own (the points' sums over frames) or a part of the matrix that no other touches.
void StructuredSolver::linearize(const BaProblem& problem, double radius, Worker* worker) {
  if (!loaded_) {
    loadFrames(problem);
    ahead_ = false;
  }
  eliminated_.fillZero();
  const PointKernels& kernels = pointKernels();
  const int points = static_cast<int>(problem.points.size());
  const PointKernelArguments a = arguments(problem, radius);
  if (worker->helps()) {
    if (!ahead_) worker->both([&] { linearizeFactors(problem); }, [&] { linearizePoints(a); });
    PointKernelArguments lower = a, upper = a;
    lower.last_position = upper.first_position = structure_.half_position;
    worker->both([&] { kernels.eliminate(lower, 0, points); }, [&] { kernels.eliminate(upper, 0, points); });
  } else {
    if (!ahead_) linearizeFactors(problem);
    frame_sums_.fillZero();
    kernels.linearizeAndEliminate(a, 0, points);
  }
  ahead_ = false;
  addPoints();
  damp(radius);
}

double StructuredSolver::linearizeFactors(const BaProblem& problem) {
  values_.fillZero();
  std::fill(full_gradient_.begin(), full_gradient_.end(), 0.0);
  double cost = linearizeImu(problem);
  cost += linearizePlanes(problem);
  cost += linearizePriors(problem);
  storeDiagonal();
  return cost;
}

void StructuredSolver::linearizePoints(const PointKernelArguments& a) {
  frame_sums_.fillZero();
  pointKernels().linearize(a, 0, static_cast<int>(structure_.point_at.size()));
}

void StructuredSolver::storeDiagonal() {
  forEachNode([&](int size, int unknown, double* block) {
    const int ld = SparseCholesky::leading(size);
    for (int k = 0; k < size; ++k) diagonal_[unknown + k] = block[k * ld + k];
  });
}

// What the points gave to their frames: J^T J and J^T r before and after the elimination.
void StructuredSolver::addPoints() {
  gradient_ = full_gradient_;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    if (frames_[f].diagonal < 0) continue;
    const double* sums = frame_sums_.data() + kFrameSums * f;
    const double* eliminated = eliminated_.data() + 8 * f;
    double* block = values_.data() + frames_[f].diagonal;
    const int u = frames_[f].unknown;
    for (int c = 0; c < 6; ++c) {
      for (int r = c; r < 6; ++r) block[8 * c + r] += sums[8 * c + r];
      diagonal_[u + c] += sums[9 * c];
      full_gradient_[u + c] += sums[48 + c];
      gradient_[u + c] += sums[48 + c] - eliminated[c];
    }
  }
}

// Ceres' rule: diag(J^T J) / radius, the diagonal before the elimination.
void StructuredSolver::damp(double radius) {
  forEachNode([&](int size, int unknown, double* block) {
    const int ld = SparseCholesky::leading(size);
    for (int k = 0; k < size; ++k) {
      damping_[unknown + k] = std::clamp(diagonal_[unknown + k], kMinDiagonal, kMaxDiagonal) / radius;
      block[k * ld + k] += damping_[unknown + k];
    }
  });
}

void StructuredSolver::forEachNode(const std::function<void(int size, int unknown, double* block)>& f) {
  for (const auto* nodes : {&structure_.pose_node, &structure_.motion_node, &structure_.plane_node}) {
    const int size = nodes == &structure_.pose_node ? 6 : nodes == &structure_.motion_node ? 9 : 3;
    for (const int node : *nodes)
      if (node >= 0)
        f(size, structure_.cholesky.unknown(node), values_.data() + structure_.cholesky.diagonalOffset(node));
  }
}

}  // namespace vip_slam
