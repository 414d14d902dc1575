// SPDX-License-Identifier: BSD-3-Clause
// The normal equations of the structured solver: factors between poses, motions and planes, and points with their
// elimination.
#include <algorithm>

#include "structured_solver.h"

namespace vip_slam {

// The result is bit-identical for any number of threads: each number is the same sum in the same order, since a thread
// adds either to its own arrays (the points' sums over frames) or to a part of the matrix that no other thread touches.
void StructuredSolver::linearize(const BaProblem& problem, double radius, Worker* worker) {
  if (!loaded_) {
    loadFrames(problem);
    ahead_ = false;
  }
  eliminated_.fillZero();
  const PointKernelArguments a = arguments(problem, radius);
  if (!ahead_)
    worker->share(1 + SystemStructure::kPointParts, [&](int piece) {
      if (piece == 0)
        linearizeFactors(problem);
      else
        linearizePoints(a, piece - 1);
    });
  ahead_ = false;
  const int ranges = worker->helps() ? SystemStructure::kRanges : 1;
  worker->share(ranges, [&](int range) {
    PointKernelArguments part = a;
    if (ranges > 1) {
      part.later_begin = structure_.range_begin[range].data();
      part.later_end = structure_.range_begin[range + 1].data();
    }
    pointKernels(instruction_set_).eliminate(part, 0, structure_.part_begin[SystemStructure::kPointParts]);
  });
  addPoints();
  damp(radius);
}

double StructuredSolver::linearizeFactors(const BaProblem& problem) {
  values_.fillZero();
  std::fill(full_gradient_.begin(), full_gradient_.end(), 0.0);
  double cost = linearizeImu(problem);
  cost += linearizePlanes(problem);
  cost += linearizeRelativePoses(problem);
  cost += linearizePriors(problem);
  storeDiagonal();
  return cost;
}

double StructuredSolver::linearizePoints(PointKernelArguments a, int part) {
  frame_sums_[part].fillZero();
  a.frame_sums = frame_sums_[part].data();
  return pointKernels(instruction_set_).linearize(a, structure_.part_begin[part], structure_.part_begin[part + 1]);
}

void StructuredSolver::storeDiagonal() {
  forEachNode([&](int size, int unknown, double* block) {
    const int ld = SparseCholesky::leading(size);
    for (int k = 0; k < size; ++k) diagonal_[unknown + k] = block[k * ld + k];
  });
}

// Adds the points' contributions to their frames: J^T J and J^T r before and after the elimination.
void StructuredSolver::addPoints() {
  gradient_ = full_gradient_;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    if (frames_[f].diagonal < 0) continue;
    static_assert(SystemStructure::kPointParts == 2, "two sums");
    const double *sums = frame_sums_[0].data() + kFrameSums * f, *more = frame_sums_[1].data() + kFrameSums * f;
    const double* eliminated = eliminated_.data() + 8 * f;
    double* block = values_.data() + frames_[f].diagonal;
    const int u = frames_[f].unknown;
    for (int c = 0; c < 6; ++c) {
      for (int r = c; r < 6; ++r) block[8 * c + r] += sums[8 * c + r] + more[8 * c + r];
      diagonal_[u + c] += sums[9 * c] + more[9 * c];
      const double gradient = sums[48 + c] + more[48 + c];
      full_gradient_[u + c] += gradient;
      gradient_[u + c] += gradient - eliminated[c];
    }
  }
}

// Ceres' rule: diag(J^T J) / radius, the diagonal before the elimination.
void StructuredSolver::damp(double radius) {
  forEachNode([&](int size, int unknown, double* block) {
    const int ld = SparseCholesky::leading(size);
    for (int k = 0; k < size; ++k) {
      damping_[unknown + k] = std::max(diagonal_[unknown + k], kMinDiagonal) / radius;
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
