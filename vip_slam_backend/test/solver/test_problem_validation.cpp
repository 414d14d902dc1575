// SPDX-License-Identifier: BSD-3-Clause
// Every reason for which a problem is refused, by both solvers, before anything is changed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "solver/synthetic_problem.h"
#include "vip_slam_backend/solver/ba_solver.h"

using namespace vip_slam;

namespace {

const double kNan = std::nan("");

struct BadProblem {
  const char* reason;
  std::function<void(BaProblem*)> spoil;
};

/// A problem with factors of all kinds.
BaProblem wholeProblem() {
  SyntheticOptions options;
  options.compressed = true;
  BaProblem problem = makeSyntheticProblem(options);
  options.compressed = false;
  options.uncompressed = true;
  const BaProblem other = makeSyntheticProblem(options);
  problem.homography_pairs = other.homography_pairs;
  problem.plane_samples = other.plane_samples;
  return problem;
}

const std::vector<BadProblem>& badProblems() {
  static const std::vector<BadProblem> all = {
      {"frame 2: state", [](BaProblem* p) { p->frames[2].state.T_W_I.t().x() = kNan; }},
      {"frame 2: state", [](BaProblem* p) { p->frames[2].state.v_W.x() = kNan; }},
      {"frame 2: state", [](BaProblem* p) { p->frames[2].state.bias_gyro.x() = kNan; }},
      {"frame 2: state", [](BaProblem* p) { p->frames[2].state.bias_accel.x() = kNan; }},
      {"frame 2: extrinsics", [](BaProblem* p) { p->frames[2].T_I_C.t().x() = kNan; }},
      {"point 3: position", [](BaProblem* p) { p->points[3].p_W.x() = kNan; }},
      {"point 3: its observations do not follow", [](BaProblem* p) { ++p->points[3].first; }},
      {"point 3: its observations do not follow", [](BaProblem* p) { p->points[3].count = 0; }},
      {"point 4: its observations do not follow", [](BaProblem* p) { --p->points[3].count; }},
      {"too few observations", [](BaProblem* p) { ++p->points.back().count; }},
      {"observations that belong to no point", [](BaProblem* p) { --p->points.back().count; }},
      {"observed by frame 99", [](BaProblem* p) { p->observations[5].frame = 99; }},
      {"observed by frame -1", [](BaProblem* p) { p->observations[5].frame = -1; }},
      {"an observation is not finite", [](BaProblem* p) { p->observations[5].x = kNan; }},
      {"an observation is not finite", [](BaProblem* p) { p->observations[5].y = kNan; }},
      {"or has no weight", [](BaProblem* p) { p->observations[5].weight = 0; }},
      {"or has no weight", [](BaProblem* p) { p->observations[5].weight = kNan; }},
      {"an observation is not finite", [](BaProblem* p) { p->observations[5].depth = kNan; }},
      {"an observation is not finite", [](BaProblem* p) { p->observations[5].depth_weight = -1; }},
      {"plane 1: not finite", [](BaProblem* p) { p->planes[1].plane.n.x() = kNan; }},
      {"plane 1: not finite", [](BaProblem* p) { p->planes[1].plane.d = kNan; }},
      {"plane 1: not finite", [](BaProblem* p) { p->planes[1].prior_weight = kNan; }},
      {"no unit vector", [](BaProblem* p) { p->planes[1].plane.n *= 1.01; }},
      {"an IMU factor", [](BaProblem* p) { p->imu[1].i = -1; }},
      {"an IMU factor", [](BaProblem* p) { p->imu[1].j = 99; }},
      {"an IMU factor", [](BaProblem* p) { p->imu[1].j = p->imu[1].i; }},
      {"an IMU factor", [](BaProblem* p) { p->imu[1].preintegration = nullptr; }},
      {"a compressed homography", [](BaProblem* p) { p->homographies[1].i = 99; }},
      {"a compressed homography", [](BaProblem* p) { p->homographies[1].j = -1; }},
      {"a compressed homography", [](BaProblem* p) { p->homographies[1].j = p->homographies[1].i; }},
      {"a compressed homography", [](BaProblem* p) { p->homographies[1].plane = 99; }},
      {"a compressed homography", [](BaProblem* p) { p->homographies[1].sums[5] = kNan; }},
      {"a homography pair", [](BaProblem* p) { p->homography_pairs[1].i = 99; }},
      {"a homography pair", [](BaProblem* p) { p->homography_pairs[1].j = -1; }},
      {"a homography pair", [](BaProblem* p) { p->homography_pairs[1].j = p->homography_pairs[1].i; }},
      {"a homography pair", [](BaProblem* p) { p->homography_pairs[1].plane = -1; }},
      {"a homography pair", [](BaProblem* p) { p->homography_pairs[1].pair.xy_j.x() = kNan; }},
      {"a compressed point-to-plane factor", [](BaProblem* p) { p->point_to_plane[1].frame = 99; }},
      {"a compressed point-to-plane factor", [](BaProblem* p) { p->point_to_plane[1].plane = 99; }},
      {"a compressed point-to-plane factor", [](BaProblem* p) { p->point_to_plane[1].G(2, 1) = kNan; }},
      {"a depth point on a plane", [](BaProblem* p) { p->plane_samples[1].frame = -1; }},
      {"a depth point on a plane", [](BaProblem* p) { p->plane_samples[1].plane = 99; }},
      {"a depth point on a plane", [](BaProblem* p) { p->plane_samples[1].p_C.z() = kNan; }},
      {"a depth point on a plane", [](BaProblem* p) { p->plane_samples[1].weight = kNan; }},
      {"a relative pose", [](BaProblem* p) { p->relative_poses[1].i = 99; }},
      {"a relative pose", [](BaProblem* p) { p->relative_poses[1].j = -1; }},
      {"a relative pose", [](BaProblem* p) { p->relative_poses[1].j = p->relative_poses[1].i; }},
      {"a relative pose", [](BaProblem* p) { p->relative_poses[1].T_i_j.t().x() = kNan; }},
      {"a relative pose", [](BaProblem* p) { p->relative_poses[1].sqrt_information(0, 3) = kNan; }},
      {"a gauge prior", [](BaProblem* p) { p->gauges[0].frame = 99; }},
      {"a gauge prior", [](BaProblem* p) { p->gauges[0].prior.T_W_I.t().x() = kNan; }},
      {"a motion prior", [](BaProblem* p) { p->motion_priors[0].frame = -1; }},
      {"a motion prior", [](BaProblem* p) { p->motion_priors[0].prior.bias_gyro.x() = kNan; }},
  };
  return all;
}

/// The reason for which a solver refuses a problem; that it changed nothing.
std::string refusalOf(const char* solver, const BaProblem& problem) {
  BaProblem copy = problem;
  std::string reason = "accepted";
  try {
    makeSolver(solver)->solve(copy, {});
  } catch (const std::invalid_argument& e) {
    reason = e.what();
  }
  for (std::size_t k = 3; k < problem.frames.size(); ++k)  // of the first ones some are spoilt
    EXPECT_EQ(copy.frames[k].state.T_W_I.matrix(), problem.frames[k].state.T_W_I.matrix()) << reason;
  EXPECT_EQ(copy.points.back().p_W, problem.points.back().p_W) << reason;
  EXPECT_EQ(copy.planes.back().plane.n, problem.planes.back().plane.n) << reason;
  return reason;
}

}  // namespace

TEST(ProblemValidation, AWholeProblemIsAccepted) {
  const BaProblem problem = wholeProblem();
  EXPECT_EQ(validateProblem(problem), "");
  for (const auto& factors : {problem.homographies.size(), problem.homography_pairs.size(),
                              problem.point_to_plane.size(), problem.plane_samples.size()})
    EXPECT_GT(factors, 1u);
  EXPECT_EQ(validateProblem(BaProblem()), "");
}

TEST(ProblemValidation, EveryReasonIsNamed) {
  const BaProblem good = wholeProblem();
  for (const BadProblem& bad : badProblems()) {
    BaProblem problem = good;
    bad.spoil(&problem);
    EXPECT_NE(validateProblem(problem).find(bad.reason), std::string::npos)
        << validateProblem(problem) << "\nexpected: " << bad.reason;
    for (const char* solver : {"structured", "ceres"})
      EXPECT_NE(refusalOf(solver, problem).find(bad.reason), std::string::npos) << solver << ", " << bad.reason;
  }
}
