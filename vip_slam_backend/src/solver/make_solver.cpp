// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "ceres_solver.h"
#include "structured_solver.h"

namespace vip_slam {

std::unique_ptr<BaSolver> makeSolver(const std::string& name) {
  if (name == "structured") return std::make_unique<StructuredSolver>();
  if (name == "ceres") return std::make_unique<CeresSolver>();
  throw std::invalid_argument("solver: '" + name + "', expected structured or ceres");
}

SolverSummary BaSolver::attempt(BaProblem& problem, const SolverOptions& options) {
  try {
    return solve(problem, options);
  } catch (const std::invalid_argument& error) {
    SolverSummary summary;
    summary.usable = false;
    summary.message = error.what();
    return summary;
  }
}

}  // namespace vip_slam
