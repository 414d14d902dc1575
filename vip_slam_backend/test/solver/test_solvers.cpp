// The structured solver against Ceres: the same cost, the same normal equations, the same steps, the same minimum.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "../../src/solver/ceres_solver.h"
#include "../../src/solver/structured_solver.h"
#include "solver/synthetic_problem.h"

using namespace vip_slam;

namespace {

struct Named {
  const char* name;
  SyntheticOptions options;
};

std::vector<Named> variants() {
  std::vector<Named> list;
  SyntheticOptions vi;
  list.push_back({"vi", vi});
  SyntheticOptions p = vi;
  p.uncompressed = true;
  list.push_back({"vi_p", p});
  SyntheticOptions cp = vi;
  cp.compressed = true;
  list.push_back({"vi_cp", cp});
  SyntheticOptions vip = cp;
  vip.plane_point_states = false;
  list.push_back({"vip", vip});
  return list;
}

SolverOptions exact(int iterations) {
  SolverOptions o;
  o.max_iterations = iterations;
  o.keep_iterating = true;
  return o;
}

}  // namespace

TEST(Solvers, CostIsThePlainDefinition) {
  for (const Named& v : variants()) {
    BaProblem problem = makeSyntheticProblem(v.options);
    problem.huber = 2;
    problem.depth_huber = 2;
    const double expected = evaluateCost(problem);
    for (const char* name : {"structured", "ceres"}) {
      BaProblem copy = problem;
      EXPECT_NEAR(makeSolver(name)->solve(copy, exact(1)).initial_cost, expected, 1e-9 * expected)
          << v.name << ' ' << name;
    }
  }
}

TEST(Solvers, SameNormalEquationsAndStep) {
  for (const Named& v : variants())
    for (const double huber : {0.0, 1.5}) {
      BaProblem problem = makeSyntheticProblem(v.options);
      problem.huber = problem.depth_huber = huber;
      problem.frames[2].fixed = true;
      problem.frames[5].motion = false;
      Eigen::MatrixXd H;
      Eigen::VectorXd g;
      ceresNormalEquations(problem, &H, &g);
      const double radius = 50;
      StructuredSolver solver;
      const StructuredSolver::Step mine = solver.stepAt(problem, radius);
      const Eigen::VectorXd diagonal = H.diagonal();
      H.diagonal() += diagonal.cwiseMax(1e-6).cwiseMin(1e32) / radius;
      const Eigen::VectorXd step = H.ldlt().solve(-g);
      const int n = static_cast<int>(mine.step.size());
      ASSERT_EQ(n + mine.point_step.size(), step.size()) << v.name;
      EXPECT_LT((mine.gradient - g.head(n)).norm(), 1e-9 * g.norm()) << v.name;
      EXPECT_LT((mine.diagonal - diagonal.head(n)).cwiseAbs().maxCoeff(), 1e-9 * diagonal.maxCoeff()) << v.name;
      EXPECT_LT((mine.step - step.head(n)).norm(), 1e-7 * step.norm()) << v.name << " huber " << huber;
      EXPECT_LT((mine.point_step - step.tail(step.size() - n)).norm(), 1e-7 * step.norm()) << v.name;
    }
}

TEST(Solvers, SameIteratesAndMinimum) {
  for (const Named& v : variants()) {
    const BaProblem start = makeSyntheticProblem(v.options);
    BaProblem a = start, b = start;
    const SolverSummary mine = makeSolver("structured")->solve(a, exact(12));
    const SolverSummary reference = makeSolver("ceres")->solve(b, exact(12));
    for (std::size_t k = 0; k < std::min<std::size_t>({mine.log.size(), reference.log.size(), 6}); ++k)
      EXPECT_NEAR(mine.log[k].cost, reference.log[k].cost, 1e-5 * reference.log[k].cost)
          << v.name << " iteration " << k;
    EXPECT_LT(mine.final_cost, 0.5 * mine.initial_cost) << v.name;
    EXPECT_NEAR(mine.final_cost, reference.final_cost, 1e-6 * reference.final_cost) << v.name;
    for (std::size_t k = 0; k < a.frames.size(); ++k)
      EXPECT_LT(a.frames[k].state.T_W_I.boxminus(b.frames[k].state.T_W_I).norm(), 1e-5) << v.name;
    for (std::size_t k = 0; k < a.planes.size(); ++k)
      EXPECT_LT(a.planes[k].plane.boxminus(b.planes[k].plane).norm(), 1e-5) << v.name;
  }
}

// A trial step linearises the factors together with its cost. After a rejected trial no trace of that may remain: the
// next step equals that of a solver started at the same state.
TEST(Solvers, RefusedStepsLeaveNothingBehind) {
  for (const Named& v : variants())
    for (const int threads : {1, 2}) {
      BaProblem start = makeSyntheticProblem(v.options);
      start.relative_poses.clear();  // with them no step is rejected
      for (std::size_t k = 0; k < start.frames.size(); ++k) {
        NavState& state = start.frames[k].state;
        state.T_W_I = state.T_W_I.boxplus((Vector6d() << 0, 0, k % 2 ? 1 : -1, 0, 0, 0).finished());
      }
      SolverOptions options = exact(6);
      options.initial_radius = 1e8;
      options.threads = threads;
      BaProblem a = start, b = start;
      const SolverSummary whole = makeSolver("structured")->solve(a, options);
      int refused = 0;
      while (refused < 5 && whole.log[refused].accepted) ++refused;
      ASSERT_LT(refused, 5) << v.name;
      options.max_iterations = refused;
      makeSolver("structured")->solve(b, options);
      options.max_iterations = 1;
      options.initial_radius = whole.log[refused + 1].radius;
      const double expected = makeSolver("structured")->solve(b, options).log[0].cost;
      EXPECT_NEAR(whole.log[refused + 1].cost, expected, 1e-6 * expected) << v.name << ", threads: " << threads;
    }
}

TEST(Solvers, FindTheTruthWithoutNoise) {
  for (const Named& v : variants()) {
    SyntheticOptions options = v.options;
    options.noise = 0;
    BaProblem truth;
    BaProblem problem = makeSyntheticProblem(options, &truth);
    makeSolver("structured")->solve(problem, exact(25));
    for (std::size_t k = 0; k < problem.frames.size(); ++k)
      EXPECT_LT(problem.frames[k].state.T_W_I.boxminus(truth.frames[k].state.T_W_I).norm(), 1e-3) << v.name;
  }
}

TEST(Solvers, TwoThreadsFindTheSameToTheLastBit) {
  for (const Named& v : variants()) {
    SyntheticOptions options = v.options;
    options.free_points = 400;
    const BaProblem start = makeSyntheticProblem(options);
    BaProblem a = start, b = start;
    SolverOptions o = exact(5);
    makeSolver("structured")->solve(a, o);
    o.threads = 2;
    makeSolver("structured")->solve(b, o);
    for (std::size_t k = 0; k < a.frames.size(); ++k) {
      EXPECT_EQ(a.frames[k].state.T_W_I.t(), b.frames[k].state.T_W_I.t()) << v.name;
      EXPECT_EQ(a.frames[k].state.T_W_I.rotation().coeffs(), b.frames[k].state.T_W_I.rotation().coeffs()) << v.name;
    }
  }
}

TEST(Solvers, SymbolicFactorisationIsKept) {
  BaProblem problem = makeSyntheticProblem({});
  SystemStructure structure;
  EXPECT_TRUE(structure.update(problem));
  problem.points[0].p_W.x() += 1;
  EXPECT_FALSE(structure.update(problem));
  problem.frames[1].fixed = true;
  EXPECT_TRUE(structure.update(problem));
}

TEST(Solvers, RefuseByName) {
  const auto messageOf = [](BaProblem problem) -> std::string {
    try {
      makeSolver("structured")->solve(problem, {});
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  BaProblem problem = makeSyntheticProblem({});
  problem.points[3].p_W.x() = std::nan("");
  EXPECT_NE(messageOf(problem).find("point 3: position is not finite"), std::string::npos);
  problem = makeSyntheticProblem({});
  problem.observations[0].frame = 99;
  EXPECT_NE(messageOf(problem).find("frame 99"), std::string::npos);
  EXPECT_THROW(makeSolver("gauss"), std::invalid_argument);
}
