// SPDX-License-Identifier: BSD-3-Clause
// What the measurements of an inertial problem leave free, and that the priors hold this and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include <Eigen/Dense>

#include "../../src/solver/ceres_solver.h"
#include "optimisation/odometry_map.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

using namespace vip_slam;

namespace {

BuilderSettings simulatedSettings(const SimulatedKeyframes& world, Variant variant) {
  BuilderSettings settings;
  settings.focal = world.sensor().camera.fx;
  settings.variant = variant;
  return settings;
}

BaProblem problemOf(const Map& map, const SimulatedKeyframes& world, Variant variant) {
  return buildProblem(map, globalScope(map), simulatedSettings(world, variant)).problem;
}

BaProblem withoutPriors(BaProblem problem) {
  problem.gauges.clear();
  problem.motion_priors.clear();
  return problem;
}

// The same scene in another world frame.
BaProblem moved(BaProblem problem, const SE3& T) {
  for (BaFrame& frame : problem.frames) {
    frame.state.T_W_I = T * frame.state.T_W_I;
    frame.state.v_W = T.rotation() * frame.state.v_W;
  }
  for (BaPoint& point : problem.points) point.p_W = T * point.p_W;
  for (BaPlane& plane : problem.planes) plane.plane = transformPlane(T, plane.plane);
  return problem;
}

// Ascending eigenvalues of J^T J with a unit diagonal, which does away with the units.
Eigen::VectorXd spectrum(BaProblem problem) {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  ceresNormalEquations(problem, &H, &g);
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scale.asDiagonal() * H * scale.asDiagonal(),
                                                        Eigen::EigenvaluesOnly)
      .eigenvalues();
}

SE3 yaw(double angle, const Eigen::Vector3d& t) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())), t);
}

// Tangent of all unknowns, in the order of ceresNormalEquations(), from `a` to `b`.
Eigen::VectorXd difference(const BaProblem& a, const BaProblem& b) {
  std::vector<double> d;
  const auto add = [&d](const Eigen::VectorXd& v) { d.insert(d.end(), v.data(), v.data() + v.size()); };
  for (std::size_t k = 0; k < a.frames.size(); ++k) add(b.frames[k].state.T_W_I.boxminus(a.frames[k].state.T_W_I));
  for (std::size_t k = 0; k < a.frames.size(); ++k) {
    const NavState &from = a.frames[k].state, &to = b.frames[k].state;
    add(to.v_W - from.v_W);
    add(to.bias_gyro - from.bias_gyro);
    add(to.bias_accel - from.bias_accel);
  }
  for (std::size_t k = 0; k < a.planes.size(); ++k) add(b.planes[k].plane.boxminus(a.planes[k].plane));
  for (std::size_t k = 0; k < a.points.size(); ++k) add(b.points[k].p_W - a.points[k].p_W);
  return Eigen::Map<Eigen::VectorXd>(d.data(), d.size());
}

// How much J^T J resists a small motion of everything, compared with its largest entry.
double resistance(BaProblem problem, const Vector6d& motion) {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  ceresNormalEquations(problem, &H, &g);
  const double step = 1e-5;
  const SE3 there(expQuaternion(step * motion.head<3>()), step * motion.tail<3>());
  const Eigen::VectorXd d =
      difference(problem, moved(problem, there)) - difference(problem, moved(problem, there.inverse()));
  return (H * d.normalized()).norm() / H.diagonal().maxCoeff();
}

Map mapWithoutImu(Map map) {
  for (const auto& entry : map.keyframes()) map.keyframe(entry.first).preintegration = nullptr;
  return map;
}

std::vector<NavState> statesOf(const BaProblem& problem) {
  std::vector<NavState> states;
  for (const BaFrame& frame : problem.frames) states.push_back(frame.state);
  return states;
}

struct LargestDifference {
  double position = 0, velocity = 0, bias_gyro = 0, bias_accel = 0;

  LargestDifference(const BaProblem& problem, const std::vector<NavState>& others) {
    for (std::size_t k = 0; k < others.size(); ++k) {
      const NavState &a = problem.frames[k].state, &b = others[k];
      position = std::max(position, (a.T_W_I.t() - b.T_W_I.t()).norm());
      velocity = std::max(velocity, (a.v_W - b.v_W).norm());
      bias_gyro = std::max(bias_gyro, (a.bias_gyro - b.bias_gyro).norm());
      bias_accel = std::max(bias_accel, (a.bias_accel - b.bias_accel).norm());
    }
  }
};

constexpr Variant kAll[] = {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip};
constexpr double kZero = 1e-12, kFree = 1e-8;  // eigenvalues: of no information, and more than the least there is

}  // namespace

TEST(GaugeFreedom, YawAndPositionAreFreeAndNothingElse) {
  for (const Variant variant : kAll) {
    SimulatedKeyframes world(4, 250);
    const BaProblem problem = withoutPriors(problemOf(mapOfOdometry(&world, 8), world, variant));
    ASSERT_FALSE(problem.points.empty() || problem.imu.empty());
    if (variant != Variant::kVi) ASSERT_FALSE(problem.planes.empty());
    const Eigen::VectorXd eigenvalues = spectrum(problem);
    EXPECT_LT(eigenvalues.head<4>().cwiseAbs().maxCoeff(), kZero) << variantName(variant);
    EXPECT_GT(eigenvalues(4), kFree) << variantName(variant);
    for (int k = 0; k < 6; ++k) {
      const double found = resistance(problem, Vector6d::Unit(k));
      if (k < 2)
        EXPECT_GT(found, 1e-7) << variantName(variant) << ' ' << k;  // roll and pitch
      else
        EXPECT_LT(found, 1e-9) << variantName(variant) << ' ' << k;
    }
  }
}

TEST(GaugeFreedom, TheCostIsThatOfAnyOtherYawAndPosition) {
  for (const Variant variant : kAll) {
    SimulatedKeyframes world(4, 250);
    const BaProblem problem = withoutPriors(problemOf(mapOfOdometry(&world, 8), world, variant));
    const double cost = evaluateCost(problem);
    EXPECT_NEAR(evaluateCost(moved(problem, yaw(2.1, {10, -20, 5}))), cost, 1e-9 * cost) << variantName(variant);
    const SE3 tilt(expQuaternion(Eigen::Vector3d(0.01, 0, 0)), Eigen::Vector3d::Zero());
    EXPECT_GT(evaluateCost(moved(problem, tilt)), 1.01 * cost) << variantName(variant);
  }
}

TEST(GaugeFreedom, ThePriorsHoldYawAndPosition) {
  for (const Variant variant : kAll) {
    SimulatedKeyframes world(4, 250);
    BaProblem problem = problemOf(mapOfOdometry(&world, 8), world, variant);
    ASSERT_EQ(problem.gauges.size(), 1u);
    EXPECT_FALSE(problem.gauges[0].prior.tilt);
    EXPECT_EQ(problem.motion_priors.size(), 1u);
    EXPECT_GT(spectrum(problem)(0), kFree) << variantName(variant);
    problem.motion_priors.clear();
    EXPECT_GT(spectrum(problem)(0), kFree) << variantName(variant);
  }
}

TEST(GaugeFreedom, WithoutImuThePriorsHoldTheTiltToo) {
  SimulatedKeyframes world(4, 250);
  BaProblem problem = problemOf(mapWithoutImu(mapOfOdometry(&world, 8)), world, Variant::kVi);
  ASSERT_EQ(problem.gauges.size(), 1u);
  EXPECT_TRUE(problem.gauges[0].prior.tilt);
  EXPECT_EQ(problem.motion_priors.size(), 8u);
  EXPECT_GT(spectrum(problem)(0), kFree);
  problem.gauges.clear();
  const Eigen::VectorXd eigenvalues = spectrum(problem);
  EXPECT_LT(eigenvalues.head<6>().cwiseAbs().maxCoeff(), kZero);
  EXPECT_GT(eigenvalues(6), kFree);
}

// The first keyframe's velocity and biases are held about an estimate that is off. By this the solution changes less
// than a tenth of its error.
TEST(GaugeFreedom, TheMotionPriorHardlyChangesTheSolution) {
  for (const unsigned seed : {1, 2, 3}) {
    SimulatedKeyframes world(seed);
    Map map = mapOfOdometry(&world, 20);
    NavState first = map.keyframe(1).state;
    first.v_W += Eigen::Vector3d(0.1, -0.1, 0.05);
    first.bias_gyro += Eigen::Vector3d(0.002, -0.002, 0.002);
    first.bias_accel += Eigen::Vector3d(0.03, 0.03, -0.03);
    map.setState(1, first, ImuNoise());
    BaProblem held = problemOf(map, world, Variant::kVip), free = held;
    free.motion_priors.clear();
    SolverOptions options;
    options.max_iterations = 30;
    options.keep_iterating = true;
    for (BaProblem* problem : {&held, &free}) ASSERT_TRUE(makeSolver("structured")->solve(*problem, options).usable);
    std::vector<NavState> truth;
    for (const auto& entry : map.keyframes()) truth.push_back(world.truth(entry.second.data->frame.t));
    const LargestDifference error(free, truth), change(held, statesOf(free));
    EXPECT_LT(change.position, 0.1 * error.position) << seed;
    EXPECT_LT(change.velocity, 0.1 * error.velocity) << seed;
    EXPECT_LT(change.bias_gyro, 0.1 * error.bias_gyro) << seed;
    EXPECT_LT(change.bias_accel, 0.1 * error.bias_accel) << seed;
  }
}
