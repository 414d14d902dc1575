// SPDX-License-Identifier: BSD-3-Clause
// Planes that only one keyframe sees, and planes through the world's origin, where the closest point tells no normal:
// through the local and the global adjustment with both solvers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "optimisation/odometry_map.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/optimisation/global_ba.h"

using namespace vip_slam;

namespace {

constexpr int kLong = 30, kExact = 10;  // keyframes, and those at their true poses
constexpr PlaneId kWall = 2, kBoard = 9;
const Plane kTrueWall(Eigen::Vector3d(1, 0, 0), 4);

struct Adjustment {
  const char* solver;
  bool global;
};
constexpr Adjustment kAdjustments[] = {{"structured", false}, {"ceres", false}, {"structured", true}, {"ceres", true}};

Map adjusted(const Map& map, const SimulatedKeyframes& world, const Adjustment& how) {
  GlobalBaProblem job;
  job.map = std::make_shared<const Map>(map);
  job.settings.focal = world.sensor().camera.fx;
  job.settings.measurement.surface_sigma = 1e-5;  // flat: points say where it is, too
  job.solver = how.solver;
  Map out = map;
  if (how.global) {
    const GlobalBaSolution solution = solveGlobalBa(job);
    EXPECT_TRUE(solution.summary.usable);
    mergeGlobalBa(solution, job.noise, &out);
  } else {
    BuiltProblem built = buildProblem(map, localScope(map, LocalBaOptions()), job.settings);
    EXPECT_TRUE(makeSolver(how.solver)->solve(built.problem, SolverOptions()).usable);
    storeProblem(built, job.noise, &out);
    removeOutliers(built, job.settings.measurement.outlier_chi2, &out);
  }
  return out;
}

// Everything by `t`.
Map shifted(Map map, const Eigen::Vector3d& t) {
  const SE3 motion(Eigen::Quaterniond::Identity(), t);
  std::map<KeyframeId, SE3> poses;
  for (const auto& entry : map.keyframes()) poses[entry.first] = motion * entry.second.state.T_W_I;
  map.moveKeyframes(poses);
  for (const auto& entry : map.planes()) map.movePlane(entry.first, motion);
  return map;
}

void forgetBut(KeyframeId one, PlaneId plane, Map* map) {
  for (const auto& entry : map->keyframes()) {
    PlaneObservation none;
    none.keyframe = entry.first;
    none.plane = plane;
    if (entry.first != one) map->setPlaneObservation(none);
  }
}

int observers(const Map& map, PlaneId plane) {
  int sum = 0;
  for (const auto& entry : map.keyframes()) sum += static_cast<int>(entry.second.planes.count(plane));
  return sum;
}

KeyframeId newestObserver(const Map& map, PlaneId plane) {
  KeyframeId newest = 0;
  for (const auto& entry : map.keyframes())
    if (entry.second.planes.count(plane)) newest = entry.first;
  return newest;
}

// An inclined board before the newest keyframe but three; its estimate is 2 cm off. Returns the true plane.
Plane addBoard(const SimulatedKeyframes& world, Map* map) {
  const KeyframeId id = map->newestKeyframe() - 3;
  const SE3 T_W_C = world.truth(map->keyframe(id).data->frame.t).T_W_I * map->keyframe(id).T_I_C;
  const Plane board = transformPlane(T_W_C, Plane(Eigen::Vector3d(0.3, -0.4, -0.866), 1.2));
  PlaneEstimate estimate;
  estimate.id = kBoard;
  estimate.plane = board.boxplus({0.01, 0.01, 0.02});
  map->setPlane(estimate);
  PlaneObservation seen;
  seen.keyframe = id;
  seen.plane = kBoard;
  for (double x = -0.4; x < 0.5; x += 0.1)
    for (double y = -0.3; y < 0.4; y += 0.1) {
      const Eigen::Vector3d ray = T_W_C.R() * Eigen::Vector3d(x, y, 1);
      const double z = -board.signedDistance(T_W_C.t()) / board.n.dot(ray);
      seen.points.push_back({(z * Eigen::Vector3d(x, y, 1)).cast<float>(), 0.01f});
      const Eigen::Vector4d p = seen.points.back().p_C.cast<double>().homogeneous();
      seen.G += p * p.transpose() / (0.01 * 0.01);
    }
  map->setPlaneObservation(seen);
  return board;
}

// Of a keyframe from one map to the other, metres and radians.
double largestMotion(const Map& a, const Map& b) {
  double largest = 0;
  for (const auto& entry : a.keyframes()) {
    const SE3& there = b.keyframe(entry.first).state.T_W_I;
    largest = std::max(largest, there.boxminus(entry.second.state.T_W_I).norm());
  }
  return largest;
}

void expectPlane(const Map& map, PlaneId id, const Plane& truth, const std::string& where) {
  const Plane& found = map.planes().at(id).estimate.plane;
  EXPECT_TRUE(map.planes().at(id).optimised) << where;
  EXPECT_LT(angleBetween(found, truth), 0.2 * M_PI / 180) << where;
  EXPECT_GT(found.n.dot(truth.n), 0) << where;
  EXPECT_NEAR(found.d, truth.d, 0.01) << where;
}

std::string name(const Adjustment& how) { return std::string(how.solver) + (how.global ? ", global" : ", local"); }

}  // namespace

// Its points are seen by other keyframes, too; one sees it with depth.
TEST(PlanePositions, AWallSeenOnce) {
  for (const Adjustment& how : kAdjustments) {
    SimulatedKeyframes world(2);
    Map map = mapOfOdometry(&world, kLong, kExact);
    forgetBut(newestObserver(map, kWall), kWall, &map);
    ASSERT_EQ(observers(map, kWall), 1);
    map.setPlaneParameters(kWall, kTrueWall.boxplus({0.01, -0.01, 0.02}));
    const Map solved = adjusted(map, world, how);
    EXPECT_EQ(checkMap(solved), "") << name(how);
    expectPlane(solved, kWall, kTrueWall, name(how));
    EXPECT_LT(positionError(solved, world), 0.01) << name(how);
  }
}

// Nothing but the depth of one keyframe tells where it is.
TEST(PlanePositions, ABoardWithoutPointsSeenOnce) {
  for (const Adjustment& how : kAdjustments) {
    SimulatedKeyframes world(2);
    Map map = mapOfOdometry(&world, kLong, kExact);
    const Map without = adjusted(map, world, how);
    const Plane truth = addBoard(world, &map);
    const Map solved = adjusted(map, world, how);
    EXPECT_EQ(checkMap(solved), "") << name(how);
    expectPlane(solved, kBoard, truth, name(how));
    EXPECT_LT(positionError(solved, world), 0.01) << name(how);
    EXPECT_LT(largestMotion(without, solved), 1e-3) << name(how);
  }
}

TEST(PlanePositions, AWallThroughTheOrigin) {
  for (const Adjustment& how : kAdjustments)
    for (const double d : {0.0, 1e-9, 0.02, -0.02}) {  // the estimate is 0.03 more: the last one crosses zero
      SimulatedKeyframes world(2);
      Map map = mapOfOdometry(&world, kLong, kExact);
      map.setPlaneParameters(kWall, kTrueWall.boxplus({0.01, -0.01, 0.03}));
      const Map elsewhere = adjusted(map, world, how);
      const Eigen::Vector3d there = (kTrueWall.d - d) * kTrueWall.n;
      Map solved = adjusted(shifted(map, there), world, how);
      EXPECT_EQ(checkMap(solved), "") << name(how);
      expectPlane(solved, kWall, Plane(kTrueWall.n, d), name(how));
      solved = shifted(solved, -there);
      EXPECT_LT(positionError(solved, world), 0.01) << name(how);
      EXPECT_LT(largestMotion(elsewhere, solved), 1e-6) << name(how) << ' ' << d;
    }
}
