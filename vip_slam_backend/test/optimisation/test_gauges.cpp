// SPDX-License-Identifier: BSD-3-Clause
// Which frames of a problem are held, where parts of a map are tied by planes alone.
#include <gtest/gtest.h>

#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_backend/solver/ba_solver.h"

using namespace vip_slam;

namespace {

// Two stretches of three keyframes with neither landmarks nor motion in common: the second one is `shift` off. They see
// the first `planes` of two walls and the ceiling, which the cameras look at (z is up).
struct TwoStretches {
  Map map;

  TwoStretches(int planes, const Eigen::Vector3d& shift) {
    const std::vector<Plane> all = {Plane({-1, 0, 0}, 3), Plane({0, -1, 0}, 2), Plane({0, 0, -1}, 1.5)};
    for (int p = 0; p < planes; ++p) {
      PlaneEstimate estimate;
      estimate.id = static_cast<PlaneId>(p + 1);
      estimate.kind = p == 2 ? PlaneKind::kHorizontal : PlaneKind::kVertical;
      estimate.plane = all[p];
      map.setPlane(estimate);
    }
    for (int k = 0; k < 6; ++k) {
      auto keyframe = std::make_shared<Keyframe>();
      keyframe->id = static_cast<KeyframeId>(k + 1);
      keyframe->frame.t = k;
      NavState& state = keyframe->frame.state;
      state.t = k;
      state.T_W_I = truth(k);
      if (k >= 3) state.T_W_I.t() += shift;
      map.addKeyframe(keyframe, state, ImuNoise());
      // Odometry ties the keyframes of a stretch.
      if (k % 3 != 0) {
        MapKeyframe& kf = map.keyframe(keyframe->id);
        kf.previous = keyframe->id - 1;
        map.keyframe(kf.previous).next = keyframe->id;
        kf.motion.T_a_b = truth(k - 1).inverse() * truth(k);
        kf.motion.covariance = 1e-6 * Matrix6d::Identity();
      }
      for (int p = 0; p < planes; ++p) map.setPlaneObservation(seen(k, p, all[p]));
    }
    EXPECT_EQ(checkMap(map), "");
  }
  static SE3 truth(int k) {
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * k, Eigen::Vector3d::UnitZ())),
               Eigen::Vector3d(0.2 * k, 0, 0));
  }
  static PlaneObservation seen(int k, int p, const Plane& plane) {
    PlaneObservation observation;
    observation.keyframe = static_cast<KeyframeId>(k + 1);
    observation.plane = static_cast<PlaneId>(p + 1);
    const Eigen::Vector3d u = plane.n.unitOrthogonal(), v = plane.n.cross(u);
    for (int i = -2; i <= 2; ++i)
      for (int j = -2; j <= 2; ++j) {
        const Eigen::Vector3d centre = -plane.d * plane.n + (p < 2 ? 2 : 0) * Eigen::Vector3d::UnitZ();
        const Eigen::Vector3d p_W = centre + 0.3 * i * u + 0.3 * j * v;
        const Eigen::Vector3d p_C = truth(k).inverse() * p_W;
        observation.points.push_back({p_C.cast<float>(), 0.02f});
        const Eigen::Vector4d h = p_C.homogeneous();
        observation.G += h * h.transpose() / (0.02 * 0.02);
      }
    return observation;
  }
};

BuiltProblem built(const Map& map) { return buildProblem(map, globalScope(map), BuilderSettings()); }

}  // namespace

TEST(Gauges, PlanesInAllDirectionsTieParts) {
  const Eigen::Vector3d shift(0.01, -0.02, 0.015);
  TwoStretches stretches(3, shift);
  BuiltProblem problem = built(stretches.map);
  ASSERT_EQ(problem.problem.gauges.size(), 1u);
  EXPECT_EQ(problem.problem.gauges[0].frame, 0);
  for (const char* solver : {"structured", "ceres"}) {
    BaProblem solved = problem.problem;
    ASSERT_TRUE(makeSolver(solver)->solve(solved, SolverOptions()).usable);
    for (int k = 3; k < 6; ++k)
      EXPECT_LT(solved.frames[k].state.T_W_I.boxminus(TwoStretches::truth(k)).norm(), 2e-4) << solver << " " << k;
  }
}

// Along the edge of two planes nothing else would hold the second stretch.
TEST(Gauges, PlanesThatLeaveADirectionFreeDoNot) {
  for (int planes = 0; planes <= 2; ++planes) {
    TwoStretches stretches(planes, Eigen::Vector3d::Zero());
    const BuiltProblem problem = built(stretches.map);
    ASSERT_EQ(problem.problem.gauges.size(), 2u) << planes;
    EXPECT_EQ(problem.problem.gauges[0].frame, 0);
    EXPECT_EQ(problem.problem.gauges[1].frame, 3);
  }
}

// Gravity holds the tilt of the part that has an IMU.
TEST(Gauges, OnlyThePartWithoutImuHoldsItsTilt) {
  TwoStretches stretches(0, Eigen::Vector3d::Zero());
  std::vector<ImuSample> at_rest(2);
  at_rest[1].t = 0.005;
  for (ImuSample& sample : at_rest) sample.accel = gravityVector();
  stretches.map.keyframe(5).preintegration =
      std::make_shared<Preintegration>(at_rest, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), ImuNoise());
  const BaProblem problem = built(stretches.map).problem;
  ASSERT_EQ(problem.gauges.size(), 2u);
  EXPECT_TRUE(problem.gauges[0].prior.tilt);
  EXPECT_FALSE(problem.gauges[1].prior.tilt);
  EXPECT_EQ(problem.gauges[1].prior.T_W_I.matrix(), stretches.map.keyframe(4).state.T_W_I.matrix());
}
