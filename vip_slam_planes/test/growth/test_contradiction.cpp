// SPDX-License-Identifier: BSD-3-Clause
// When an image shows another surface in place of a plane.
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/growth/contradiction.h"

namespace vip_slam {
namespace {

class Contradiction : public ::testing::Test {
 protected:
  // A level plane of 0.6 x 1.2 m, 0.5 m above the floor.
  static PlaneTrack level() {
    PlaneTrack track(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, -0.5), {0, 0, 0.5}, 0.1);
    for (int y = -6; y < 6; ++y)
      for (int x = -3; x < 3; ++x) track.coverCell({x, y}, 1, 1, SE3());
    return track;
  }
  // Mesh triangles of a surface through the plane's middle that rises by `slope` along x, from x = first to last.
  std::vector<MapTriangle> surface(double slope, double sigma, double first = -0.3, double last = 0.3) {
    std::vector<MapTriangle> triangles;
    std::normal_distribution<double> gauss;
    for (double y = -0.55; y < 0.6; y += 0.1) {
      for (double x = first + 0.05; x < last; x += 0.1) {
        MapTriangle t;
        t.n = Eigen::Vector3d(-std::tan(slope), 0, 1).normalized();
        t.centre = {x, y, 0.5 + std::tan(slope) * x};
        t.centre += sigma * gauss(random_) * t.n;
        t.corner = {t.centre, t.centre, t.centre};
        t.vertex = {0, 1, 2};
        t.neighbour = {-1, -1, -1};
        t.area = 0.01;
        t.sigma = sigma;
        t.sigma_angle = sigma / 0.1;
        triangles.push_back(t);
      }
    }
    return triangles;
  }
  bool contradicted(const std::vector<MapTriangle>& triangles) {
    return planeVerdict(triangles, track_, {&track_}, PlaneDetectionOptions(), PlaneGrowthOptions()) ==
           PlaneVerdict::kAgainst;
  }
  const PlaneTrack track_ = level();
  std::mt19937 random_{5};
};

TEST_F(Contradiction, ARampIsNoLevelPlane) {
  EXPECT_TRUE(contradicted(surface(13 * kDegree, 0.003)));
  EXPECT_TRUE(contradicted(surface(6 * kDegree, 0.003)));
  EXPECT_FALSE(contradicted(surface(0, 0.003)));
  EXPECT_FALSE(contradicted(surface(2 * kDegree, 0.003))) << "an estimated pose may lean as much";
  EXPECT_FALSE(contradicted({}));
}

TEST_F(Contradiction, NoiseThatHidesTheSlopeSpeaksForNothing) {
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(contradicted(surface(0, 0.05)));
  EXPECT_FALSE(contradicted(surface(6 * kDegree, 0.05)));
}

TEST_F(Contradiction, APartOfThePlaneDoesNotRefuteIt) {
  EXPECT_FALSE(contradicted(surface(13 * kDegree, 0.003, -0.3, -0.1)));
  EXPECT_FALSE(contradicted(surface(13 * kDegree, 0.003, 0.5, 1.1))) << "beside it";
}

TEST_F(Contradiction, WhatStandsOnItDoesNotRefuteIt) {
  std::vector<MapTriangle> triangles = surface(0, 0.003);
  for (std::size_t i = 0; i < triangles.size(); i += 3) triangles[i].centre.z() += 0.04;  // sheets, books
  EXPECT_FALSE(contradicted(triangles));
  triangles = surface(13 * kDegree, 0.003);
  for (MapTriangle& t : triangles) t.n = {1, 0, 0};  // sides of boxes
  EXPECT_FALSE(contradicted(triangles));
}

// A shelf 0.4 m deep in front of a wall, seen at such a flat angle that it has one row of points: triangles from its
// front edge over that row to the wall behind form a smooth ramp of four degrees.
TEST_F(Contradiction, TrianglesFromPlaneToPlaneTellNothing) {
  PlaneTrack shelf(1, PlaneKind::kHorizontal, Plane({0, 0, 1}, -0.9), {0, 0, 0.9}, 0.1);
  PlaneTrack wall(2, PlaneKind::kVertical, Plane({-1, 0, 0}, 0.4), {0.4, 0, 1.2}, 0.1);
  PlaneTrack front(3, PlaneKind::kVertical, Plane({-1, 0, 0}, 0), {0, 0, 0.6}, 0.1);
  const auto cover = [](PlaneTrack* track, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (double x = low.x(); x <= high.x(); x += 0.05)
      for (double y = low.y(); y <= high.y(); y += 0.05)
        for (double z = low.z(); z <= high.z(); z += 0.05)
          track->coverCell(track->cellAt(track->toPlane({x, y, z})), 1, 1, SE3());
  };
  cover(&shelf, {0, -0.8, 0.9}, {0.4, 0.8, 0.9});
  cover(&wall, {0.4, -0.8, 0.92}, {0.4, 0.8, 2});
  cover(&front, {0, -0.8, 0}, {0, 0.8, 0.88});
  std::vector<MapTriangle> triangles;
  const auto add = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    MapTriangle t;
    t.corner = {a, b, c};
    t.vertex = {0, 1, 2};
    t.neighbour = {-1, -1, -1};
    t.centre = (a + b + c) / 3;
    t.n = Eigen::Vector3d(-0.075, 0, 1).normalized();
    t.area = 0.005;
    t.sigma = 0.001;
    t.sigma_angle = 0.01;
    triangles.push_back(t);
  };
  for (double y = -0.75; y < 0.7; y += 0.05) {
    const Eigen::Vector3d step(0, 0.05, 0), low(0, y, 0.873), top(0.2, y, 0.9), high(0.4, y, 0.925);
    add(low, low + step, top);
    add(low + step, top, top + step);
    add(top, top + step, high);
    add(top + step, high, high + step);
  }
  const auto verdict = [&](const std::vector<const PlaneTrack*>& all) {
    return planeVerdict(triangles, shelf, all, PlaneDetectionOptions(), PlaneGrowthOptions());
  };
  EXPECT_EQ(verdict({&shelf}), PlaneVerdict::kAgainst);
  EXPECT_EQ(verdict({&shelf, &wall, &front}), PlaneVerdict::kNone);
}

}  // namespace
}  // namespace vip_slam
