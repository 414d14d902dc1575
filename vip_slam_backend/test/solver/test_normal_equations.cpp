// SPDX-License-Identifier: BSD-3-Clause
// The structured solver's normal equations and damped steps against those of Ceres' Jacobians, with the kernels of
// every instruction set this machine runs.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "../../src/solver/ceres_solver.h"
#include "../../src/solver/structured_solver.h"
#include "solver/solver_variants.h"

using namespace vip_slam;

namespace {

// The normal equations of poses, motions, planes and points.
class Reference {
 public:
  explicit Reference(BaProblem problem) {
    ceresNormalEquations(problem, &H_, &gradient);
    diagonal = H_.diagonal();
    damped_ = diagonal.cwiseMax(1e-6).cwiseMin(1e32);
    sigma = damped_.cwiseSqrt().cwiseInverse();
  }
  Eigen::VectorXd step(double radius) const {
    Eigen::MatrixXd H = H_;
    H.diagonal() += damped_ / radius;
    H = sigma.asDiagonal() * H * sigma.asDiagonal();
    return sigma.cwiseProduct(H.ldlt().solve(-sigma.cwiseProduct(gradient)));
  }

  // Of each unknown while all others are known; in these units none is lost beside others of other units.
  Eigen::VectorXd sigma;
  Eigen::VectorXd gradient, diagonal;

 private:
  Eigen::MatrixXd H_;
  Eigen::VectorXd damped_;
};

Eigen::VectorXd joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd both(a.size() + b.size());
  both << a, b;
  return both;
}

void expectSameEquations(const BaProblem& problem, const std::string& where) {
  const Reference reference(problem);
  for (const double radius : {50.0, 1e7}) {
    const Eigen::VectorXd step = reference.step(radius);
    for (const InstructionSet set : instructionSets()) {
      SCOPED_TRACE(where + ", radius " + std::to_string(radius) + ", " + instructionSetName(set));
      const StructuredSolver::Step mine = StructuredSolver(set).stepAt(problem, radius);
      const Eigen::VectorXd gradient = joined(mine.gradient, mine.point_gradient);
      ASSERT_EQ(gradient.size(), step.size());
      const Eigen::VectorXd diagonal = reference.diagonal.head(mine.diagonal.size());
      EXPECT_LT((gradient - reference.gradient).cwiseProduct(reference.sigma).norm(), 1e-9);
      EXPECT_LT((mine.diagonal - diagonal).cwiseQuotient(diagonal).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((joined(mine.step, mine.point_step) - step).cwiseQuotient(reference.sigma).norm(), 1e-7);
    }
  }
}

}  // namespace

TEST(NormalEquations, SameAsCeresAlongARun) {
  for (const bool rig : {false, true})
    for (const SolverVariant& v : variants())
      for (const bool robust : {false, true}) {
        BaProblem problem = makeSyntheticProblem(rig ? withDifferentCameras(v.options) : v.options);
        if (robust) problem.huber = 1, problem.depth_huber = 2;
        problem.frames[2].fixed = true;
        problem.frames[5].motion = false;
        for (int iterate = 0; iterate <= 5; ++iterate) {
          expectSameEquations(problem, std::string(v.name) + (rig ? ", different cameras" : "") +
                                           (robust ? ", robust" : "") + ", iterate " + std::to_string(iterate));
          makeSolver("structured")->solve(problem, exact(1));
        }
      }
}
