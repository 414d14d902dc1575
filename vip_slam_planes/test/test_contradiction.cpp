// When an image shows another surface where a plane is said to be.
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
  // What a mesh shows of a surface through the plane's middle that rises by `slope` along x, from x = first to last.
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
    return isContradicted(triangles, track_, PlaneDetectionOptions(), PlaneGrowthOptions());
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

}  // namespace
}  // namespace vip_slam
