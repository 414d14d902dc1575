// SPDX-License-Identifier: BSD-3-Clause
// The reference solver: the same factors in Ceres' Levenberg-Marquardt with SPARSE_SCHUR. Used in tests, in the
// benchmark, and when the user selects it.
#pragma once

#include <memory>

#include <Eigen/Core>

#include "vip_slam_backend/solver/ba_solver.h"

namespace vip_slam {

class CeresSolver : public BaSolver {
 public:
  SolverSummary solve(BaProblem& problem, const SolverOptions& options) override;
};

/// For tests: J^T J and J^T r by Ceres at the problem's present state. Unknowns: free frames' poses in frame order,
/// free motions in frame order, planes, points.
void ceresNormalEquations(BaProblem& problem, Eigen::MatrixXd* JtJ, Eigen::VectorXd* Jtr);

}  // namespace vip_slam
