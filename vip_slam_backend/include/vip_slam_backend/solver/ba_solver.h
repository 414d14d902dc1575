// SPDX-License-Identifier: BSD-3-Clause
// The interface of the two bundle adjusters. Both run Levenberg-Marquardt with the same damping (Ceres' rule) on the
// same factors, so that their iterates agree.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

struct SolverOptions {
  int max_iterations = 10;
  double max_seconds = 0;  ///< 0: no limit
  int threads = 1;
  double initial_radius = 1e7;       ///< trust region: damping is diag(J^T J) / radius
  double function_tolerance = 1e-6;  ///< stop when the cost falls by less than this fraction
  double gradient_tolerance = 1e-10;
  double parameter_tolerance = 1e-8;
  bool keep_iterating = false;  ///< run all max_iterations regardless of the tolerances (benchmarks)
};

struct SolverIteration {
  double cost = 0;    ///< after the step, accepted or not
  double radius = 0;  ///< of the trust region that gave the step
  double step_norm = 0;
  bool accepted = false;
};

struct SolverSummary {
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;  ///< steps tried, accepted or not
  bool usable = true;  ///< false: the problem was left unchanged
  std::string message;
  double residual_ms = 0, jacobian_ms = 0, linear_ms = 0, preprocess_ms = 0, total_ms = 0;
  double postprocess_ms = 0;  ///< of Ceres; the structured solver's solution is in place as it ends
  std::size_t residual_blocks = 0, parameters = 0, observations = 0;
  std::size_t factor_size = 0;  ///< numbers in the Cholesky factor without points; 0: not known (Ceres)
  std::vector<SolverIteration> log;
};

class BaSolver {
 public:
  virtual ~BaSolver() = default;
  /// Improves the variables in place. Throws std::invalid_argument with the message of validateProblem().
  virtual SolverSummary solve(BaProblem& problem, const SolverOptions& options) = 0;
  /// As solve(), but an inconsistent problem gives an unusable summary that says why.
  SolverSummary attempt(BaProblem& problem, const SolverOptions& options);
};

/// "structured" or "ceres"; throws std::invalid_argument on others. A structured solver keeps its symbolic
/// factorisation from call to call while the structure stays the same.
std::unique_ptr<BaSolver> makeSolver(const std::string& name);

}  // namespace vip_slam
