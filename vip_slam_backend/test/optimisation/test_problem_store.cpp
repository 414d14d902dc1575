// SPDX-License-Identifier: BSD-3-Clause
// What a solved problem changes in the map.
#include <gtest/gtest.h>

#include "back_end/simulated_keyframes.h"
#include "vip_slam_backend/optimisation/global_ba.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

using namespace vip_slam;

TEST(ProblemStore, PlanesThatTheSolutionLacksMoveWithWhoSawThemLast) {
  SimulatedKeyframes world(2);
  Map map = mapAtTruePoses(&world, 2);
  for (PlaneId id = 101; id <= 103; ++id) {
    PlaneEstimate plane;
    plane.id = id;
    plane.plane = Plane(Eigen::Vector3d::UnitX(), -2);
    map.setPlane(plane);
    PlaneObservation seen;
    seen.plane = id;
    seen.points.push_back({Eigen::Vector3f(0, 0, 2), 0.01f});
    for (KeyframeId keyframe = 1; keyframe <= 2; ++keyframe) {
      if (id == 100 + 3 - keyframe) continue;  // 101 is seen by the first, 102 by the second, 103 by both
      seen.keyframe = keyframe;
      ASSERT_TRUE(map.setPlaneObservation(seen));
    }
  }
  // A solution from when only the first keyframe existed, which it shifts by 1 m.
  GlobalBaSolution solution;
  BaFrame frame;
  frame.state = map.keyframe(1).state;
  frame.state.T_W_I.t().x() += 1;
  frame.T_I_C = map.keyframe(1).T_I_C;
  solution.built.frames.push_back(1);
  solution.built.problem.frames.push_back(frame);
  mergeGlobalBa(solution, ImuNoise(), &map);
  EXPECT_EQ(checkMap(map), "");
  for (PlaneId id = 101; id <= 103; ++id) EXPECT_NEAR(map.planes().at(id).estimate.plane.d, -3, 1e-9) << id;
  EXPECT_FALSE(map.planes().at(102).optimised);
}

TEST(ProblemStore, APlaneThatNoFactorHoldsIsNotOptimised) {
  SimulatedKeyframes world(2);
  Map map = mapAtTruePoses(&world, 6);
  BuilderSettings settings;
  BuiltProblem built = buildProblem(map, globalScope(map), settings);
  ASSERT_GT(built.planes.size(), 1u);
  auto& factors = built.problem.point_to_plane;
  ASSERT_FALSE(factors.empty());
  ASSERT_TRUE(built.problem.homographies.empty());
  const int held = factors.front().plane;
  factors.resize(1);
  storeProblem(built, ImuNoise(), &map);
  EXPECT_EQ(checkMap(map), "");
  for (std::size_t p = 0; p < built.planes.size(); ++p)
    EXPECT_EQ(map.planes().at(built.planes[p]).optimised, static_cast<int>(p) == held);
}
