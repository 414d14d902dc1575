// SPDX-License-Identifier: BSD-3-Clause
// Homographies of weak geometry, from map to problem: which are refused, and that the others are finite and harmless.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optimisation/wall.h"
#include "vip_slam_backend/solver/ba_solver.h"

using namespace vip_slam;

namespace {

// Cameras beside the wall that look along it, at this distance from it: rays meet the wall at 83 to 87 degrees.
SE3 edgeOn(double distance, double along = 0) {
  Eigen::Matrix3d R_W_C;  // z along the world's x, y stays
  R_W_C << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return SE3(R_W_C, Eigen::Vector3d(along - 3, 0, 3 - distance));
}

int pairsOf(const BaProblem& problem, int host, int observer) {  // -1: any
  int sum = 0;
  for (const BaHomography& h : problem.homographies)
    if ((host < 0 || h.i == host) && (observer < 0 || h.j == observer)) sum += h.pairs;
  return sum;
}

bool isFinite(const BaProblem& problem) {
  bool finite = validateProblem(problem).empty() && std::isfinite(evaluateCost(problem));
  for (const BaHomography& h : problem.homographies) finite = finite && vip_slam::isFinite(h.sums);
  return finite;
}

BuiltProblem built(const Wall& wall) { return buildProblem(wall.map, globalScope(wall.map), wall.settings); }

// Keyframes are before the wall, and from this one on beside it.
constexpr int kFirstEdgeOn = 6;

/// Sums of squares over runs.
struct EdgeOnErrors {
  double residual = 0;  ///< whitened, of edge-on observers at the truth
  int rows = 0;
  double plane = 0, poses = 0;  ///< after the adjustment, the poses of keyframes before the wall
};

// Only some of the landmarks are on the plane; poses and plane are off.
BaProblem wallWithFew(int on_plane, Variant variant) {
  Wall wall;
  for (int k = 0; k < Wall::kKeyframes; ++k) wall.seeDepth(k);
  for (int l = on_plane; l < Wall::kLandmarks; ++l) wall.map.associate(l + 1, 0);
  wall.settings.variant = variant;
  BaProblem problem = built(wall).problem;
  for (std::size_t k = 1; k < problem.frames.size(); ++k) {
    SE3& T = problem.frames[k].state.T_W_I;
    T = T.boxplus((Vector6d() << 0.01, -0.01, 0.01, 0.02, 0.01, -0.01).finished());
  }
  problem.planes[0].plane = problem.planes[0].plane.boxplus({0.01, 0.01, 0.02});
  return problem;
}

void addRun(unsigned seed, double distance, bool use_edge_on, EdgeOnErrors* sum) {
  constexpr double kPixels = 0.2;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Wall wall;
  wall.settings.measurement.pixel_sigma = kPixels;
  wall.settings.measurement.huber = 0;  // weights of the noise alone
  std::vector<SE3> truth;
  for (int k = 0; k < Wall::kKeyframes; ++k) {
    truth.push_back(k < kFirstEdgeOn ? SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * k, 0, 0))
                                     : edgeOn(distance, 0.1 * (k - kFirstEdgeOn)));
    wall.lookFrom(k, truth[k], [&] { return kPixels * normal(random); });
  }
  BaProblem problem = built(wall).problem;
  problem.point_to_plane.clear();  // depth would hide the homographies' errors
  if (!use_edge_on)
    for (BaHomography& h : problem.homographies)
      if (h.j >= kFirstEdgeOn) h.sums = {}, h.pairs = 0;
  const std::vector<FrameGeometry> geometry = frameGeometry(problem);
  for (const BaHomography& h : problem.homographies) {
    if (h.j < kFirstEdgeOn) continue;
    const Vector9d v = homographyVector(geometry[h.i], geometry[h.j], problem.planes[h.plane].plane);
    sum->residual += v.dot(homographyMatrix(h.sums) * v);
    sum->rows += 2 * h.pairs;
  }
  for (int k = 1; k < Wall::kKeyframes; ++k) {
    BaRelativePose odometry;
    odometry.i = k - 1, odometry.j = k;
    odometry.T_i_j = truth[k - 1].inverse() * truth[k];
    odometry.sqrt_information = 1e3 * Matrix6d::Identity();  // mm and mrad
    problem.relative_poses.push_back(odometry);
  }
  problem.planes[0].plane = problem.planes[0].plane.boxplus({0.01, -0.01, 0.02});
  ASSERT_TRUE(makeSolver("structured")->solve(problem, SolverOptions()).usable);
  sum->plane += problem.planes[0].plane.boxminus(Plane({0, 0, -1}, 3)).squaredNorm();
  for (int k = 0; k < kFirstEdgeOn; ++k) sum->poses += problem.frames[k].state.T_W_I.boxminus(truth[k]).squaredNorm();
}

}  // namespace

TEST(WeakHomographies, AHostEdgeOnIsRefused) {
  for (const bool shared : {false, true}) {
    Wall one, all;
    one.settings.shared_hosts = all.settings.shared_hosts = shared;
    one.lookFrom(0, edgeOn(0.25));
    const BuiltProblem rest = built(one);
    EXPECT_EQ(pairsOf(rest.problem, 0, -1), 0);
    EXPECT_EQ(pairsOf(rest.problem, -1, -1), Wall::kLandmarks * (Wall::kKeyframes - 1));
    EXPECT_TRUE(isFinite(rest.problem));
    for (int k = 0; k < Wall::kKeyframes; ++k) all.lookFrom(k, edgeOn(0.25, 0.05 * k));
    const BuiltProblem none = built(all);
    EXPECT_TRUE(none.problem.homographies.empty());
    EXPECT_EQ(none.points.size(), static_cast<std::size_t>(Wall::kLandmarks));  // no landmark is lost
    EXPECT_TRUE(isFinite(none.problem));
  }
}

TEST(WeakHomographies, ACameraOnThePlaneIsNoHostAndHarmless) {
  for (const bool shared : {false, true})
    for (const double distance : {0.0, 1e-12, 1e-3, 0.14}) {
      Wall wall;
      wall.settings.shared_hosts = shared;
      wall.lookFrom(0, edgeOn(distance));
      wall.lookFrom(6, edgeOn(distance));
      BuiltProblem problem = built(wall);
      EXPECT_EQ(pairsOf(problem.problem, 0, -1) + pairsOf(problem.problem, 6, -1), 0) << distance;
      EXPECT_EQ(pairsOf(problem.problem, -1, -1), Wall::kLandmarks * (Wall::kKeyframes - 1)) << distance;
      EXPECT_TRUE(isFinite(problem.problem)) << distance;
      // The views are correct, and stay in the map.
      storeProblem(problem, ImuNoise(), &wall.map);
      EXPECT_TRUE(removeOutliers(problem, wall.settings.measurement.outlier_chi2, &wall.map).empty()) << distance;
    }
}

// Their weights are right, since the noise of the host's pixel shrinks on its way into the observer; they tell the
// plane's distance better than those of cameras before it, and the poses do not suffer.
TEST(WeakHomographies, AnObserverEdgeOnIsUsedAndHarmless) {
  for (const double distance : {0.3, 0.16}) {
    EdgeOnErrors with, without;
    for (unsigned seed = 1; seed <= 40; ++seed) {
      addRun(seed, distance, true, &with);
      addRun(seed, distance, false, &without);
    }
    EXPECT_EQ(with.rows, 40 * 2 * Wall::kLandmarks * (Wall::kKeyframes - kFirstEdgeOn));
    EXPECT_NEAR(with.residual / with.rows, 1.0, 0.2) << distance;
    EXPECT_LT(with.plane, 0.5 * without.plane) << distance;
    EXPECT_LT(with.poses, without.poses) << distance;
  }
}

TEST(WeakHomographies, WithoutBaselineTheyHoldPosesAndLeaveThePlaneToDepth) {
  for (const char* solver : {"structured", "ceres"}) {
    Wall wall;
    for (int k = 0; k < Wall::kKeyframes; ++k)
      wall.lookFrom(k, SE3(expQuaternion(Eigen::Vector3d(0.02 * k, 0.03 * k, -0.01 * k)), Eigen::Vector3d::Zero()));
    wall.seeDepth(0);
    BaProblem problem = built(wall).problem;
    EXPECT_EQ(pairsOf(problem, -1, -1), Wall::kLandmarks * (Wall::kKeyframes - 1));
    EXPECT_TRUE(isFinite(problem));
    const BaProblem truth = problem;
    for (std::size_t k = 1; k < truth.frames.size(); ++k) {
      SE3& T = problem.frames[k].state.T_W_I;
      T = T.boxplus((Vector6d() << 0.01, -0.02, 0.01, 0, 0, 0).finished());
    }
    problem.planes[0].plane = problem.planes[0].plane.boxplus({0.01, -0.01, 0.02});
    ASSERT_TRUE(makeSolver(solver)->solve(problem, SolverOptions()).usable);
    for (std::size_t k = 0; k < truth.frames.size(); ++k)
      EXPECT_LT(problem.frames[k].state.T_W_I.boxminus(truth.frames[k].state.T_W_I).norm(), 1e-4) << solver;
    EXPECT_LT(problem.planes[0].plane.boxminus(truth.planes[0].plane).norm(), 1e-4) << solver;
  }
}

// A homography alone needs four pairs; as a factor it is as good as its pairs one by one.
TEST(WeakHomographies, FewerThanFourPairsAreExactAndHarmless) {
  for (const int few : {1, 2, 3})
    for (const char* solver : {"structured", "ceres"}) {
      BaProblem pairs = wallWithFew(few, Variant::kViP), compressed = wallWithFew(few, Variant::kVip);
      EXPECT_EQ(pairs.homography_pairs.size(), static_cast<std::size_t>(few * (Wall::kKeyframes - 1)));
      ASSERT_EQ(compressed.homographies.size(), static_cast<std::size_t>(Wall::kKeyframes - 1));
      for (const BaHomography& h : compressed.homographies) EXPECT_EQ(h.pairs, few);
      compressed.points.clear(), pairs.points.clear();  // costs of the homographies, not of the free landmarks
      compressed.observations.clear(), pairs.observations.clear();
      const double cost = evaluateCost(pairs);
      EXPECT_NEAR(evaluateCost(compressed), cost, 1e-6 * cost);
      for (BaProblem* problem : {&pairs, &compressed}) {
        EXPECT_TRUE(isFinite(*problem));
        const SolverSummary summary = makeSolver(solver)->solve(*problem, SolverOptions());
        ASSERT_TRUE(summary.usable);
        EXPECT_LT(summary.final_cost, 1e-3 * cost) << solver << ' ' << few;
        EXPECT_TRUE(isFinite(*problem));
        EXPECT_LT(problem->planes[0].plane.boxminus(Plane({0, 0, -1}, 3)).norm(), 1e-3) << solver << ' ' << few;
      }
      BaProblem whole = wallWithFew(few, Variant::kVip);
      ASSERT_TRUE(makeSolver(solver)->solve(whole, SolverOptions()).usable);
      for (int k = 0; k < Wall::kKeyframes; ++k)
        EXPECT_LT((whole.frames[k].state.T_W_I.t() - Eigen::Vector3d(0.1 * k, 0, 0)).norm(), 1e-3) << solver << few;
    }
}
