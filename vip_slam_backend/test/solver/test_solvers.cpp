// SPDX-License-Identifier: BSD-3-Clause
// The structured solver against Ceres: the same cost, the same iterates, the same minimum; and against itself.
#include <gtest/gtest.h>

#include "../../src/solver/structured_solver.h"
#include "solver/solver_variants.h"

using namespace vip_slam;

namespace {

// Frames turned by turns to the left and right: not every step from here lowers the cost.
BaProblem farFromTheMinimum(const SyntheticOptions& options, double turn) {
  BaProblem problem = makeSyntheticProblem(options);
  problem.relative_poses.clear();  // with them no step is rejected
  for (std::size_t k = 0; k < problem.frames.size(); ++k) {
    NavState& state = problem.frames[k].state;
    state.T_W_I = state.T_W_I.boxplus((Vector6d() << 0, 0, k % 2 ? turn : -turn, 0, 0, 0).finished());
  }
  return problem;
}

struct Steps {
  int taken = 0, refused = 0;
};

// Compares up to where a step's change of the cost comes near its rounding, which then decides whether it is taken.
Steps expectSameIterates(const SolverSummary& a, const SolverSummary& b) {
  EXPECT_EQ(a.log.size(), b.log.size());
  Steps steps;
  double present = a.initial_cost;
  for (std::size_t k = 0; k < std::min(a.log.size(), b.log.size()); ++k) {
    const SolverIteration &mine = a.log[k], &other = b.log[k];
    if (std::abs(mine.cost - present) < 1e-9 * present) break;
    EXPECT_NEAR(mine.cost, other.cost, 1e-5 * other.cost) << "iteration " << k;
    EXPECT_NEAR(mine.radius, other.radius, 1e-5 * other.radius) << "iteration " << k;
    EXPECT_EQ(mine.accepted, other.accepted) << "iteration " << k;
    ++(mine.accepted ? steps.taken : steps.refused);
    if (mine.accepted) present = mine.cost;
  }
  return steps;
}

// The variables, to the last bit.
std::vector<double> variables(const BaProblem& problem) {
  std::vector<double> all;
  const auto add = [&all](const auto& vector) { all.insert(all.end(), vector.data(), vector.data() + vector.size()); };
  for (const BaFrame& f : problem.frames) {
    add(f.state.T_W_I.rotation().coeffs());
    for (const Eigen::Vector3d& v : {f.state.T_W_I.t(), f.state.v_W, f.state.bias_gyro, f.state.bias_accel}) add(v);
  }
  for (const BaPoint& p : problem.points) add(p.p_W);
  for (const BaPlane& p : problem.planes) add(p.plane.coefficients());
  return all;
}

}  // namespace

// Without iterations the solver computes the cost alone, else together with the Jacobians.
TEST(Solvers, CostIsThePlainDefinition) {
  for (const bool rig : {false, true})
    for (const SolverVariant& v : variants()) {
      SCOPED_TRACE(std::string(v.name) + (rig ? ", different cameras" : ""));
      BaProblem problem = makeSyntheticProblem(rig ? withDifferentCameras(v.options) : v.options);
      problem.huber = 2;
      problem.depth_huber = 2;
      const double expected = evaluateCost(problem);
      const auto costBy = [&](BaSolver& solver, int iterations) {
        BaProblem copy = problem;
        return solver.solve(copy, exact(iterations)).initial_cost;
      };
      EXPECT_NEAR(costBy(*makeSolver("ceres"), 1), expected, 1e-11 * expected);
      for (const InstructionSet set : instructionSets())
        for (const int iterations : {0, 1}) {
          StructuredSolver solver(set);
          EXPECT_NEAR(costBy(solver, iterations), expected, 1e-11 * expected) << instructionSetName(set);
        }
    }
}

TEST(Solvers, SameIteratesAndMinimum) {
  for (const SolverVariant& v : variants())
    for (const bool robust : {false, true}) {
      SCOPED_TRACE(std::string(v.name) + (robust ? ", robust" : ""));
      BaProblem start = makeSyntheticProblem(v.options);
      if (robust) start.huber = 1, start.depth_huber = 2;
      BaProblem a = start, b = start;
      const SolverSummary mine = makeSolver("structured")->solve(a, exact(12));
      const SolverSummary reference = makeSolver("ceres")->solve(b, exact(12));
      EXPECT_GE(expectSameIterates(mine, reference).taken, robust ? 6 : 3);
      EXPECT_LT(mine.final_cost, 0.5 * mine.initial_cost);
      EXPECT_NEAR(mine.final_cost, reference.final_cost, 1e-6 * reference.final_cost);
      for (std::size_t k = 0; k < a.frames.size(); ++k)
        EXPECT_LT(a.frames[k].state.T_W_I.boxminus(b.frames[k].state.T_W_I).norm(), 1e-5);
      for (std::size_t k = 0; k < a.planes.size(); ++k)
        EXPECT_LT(a.planes[k].plane.boxminus(b.planes[k].plane).norm(), 1e-5);
    }
}

TEST(Solvers, SameStepsAreRefused) {
  for (const SolverVariant& v : variants()) {
    SCOPED_TRACE(v.name);
    BaProblem a = farFromTheMinimum(v.options, 2.5), b = a;
    SolverOptions options = exact(8);
    options.initial_radius = 10;
    const SolverSummary mine = makeSolver("structured")->solve(a, options);
    const Steps steps = expectSameIterates(mine, makeSolver("ceres")->solve(b, options));
    EXPECT_EQ(steps.taken + steps.refused, 8);
    EXPECT_GE(steps.taken, 2);
    EXPECT_GE(steps.refused, 2);
  }
}

// A trial step linearises the factors together with its cost. After a rejected trial no trace of that may remain: the
// next step equals that of a solver started at the same state.
TEST(Solvers, RefusedStepsLeaveNothingBehind) {
  for (const SolverVariant& v : variants())
    for (const int threads : {1, 2}) {
      const BaProblem start = farFromTheMinimum(v.options, 1);
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
  for (const SolverVariant& v : variants()) {
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
  for (const SolverVariant& v : variants()) {
    SyntheticOptions options = v.options;
    options.free_points = 400;
    const BaProblem start = makeSyntheticProblem(options);
    BaProblem a = start, b = start;
    SolverOptions o = exact(5);
    makeSolver("structured")->solve(a, o);
    o.threads = 2;
    makeSolver("structured")->solve(b, o);
    EXPECT_EQ(variables(a), variables(b)) << v.name;
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

// What a solver keeps from the problems before, of the same structure or another, does not change its solution.
TEST(Solvers, ReusedSolverFindsTheSameToTheLastBit) {
  for (const SolverVariant& v : variants())
    for (const int threads : {1, 2}) {
      const BaProblem first = makeSyntheticProblem(v.options),
                      third = makeSyntheticProblem(withDifferentCameras(v.options));
      BaProblem second = first;
      for (BaObservation& o : second.observations) o.x += 0.003, o.weight *= 0.8;
      for (BaFrame& f : second.frames) f.state.v_W.x() += 0.05;
      second.huber = 1;
      SolverOptions options = exact(4);
      options.threads = threads;
      StructuredSolver reused;
      for (const BaProblem& problem : {first, second, third, first}) {
        BaProblem a = problem, b = problem;
        const double cost = reused.solve(a, options).final_cost;
        EXPECT_EQ(cost, StructuredSolver().solve(b, options).final_cost) << v.name << ", threads: " << threads;
        EXPECT_EQ(variables(a), variables(b)) << v.name << ", threads: " << threads;
      }
    }
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
