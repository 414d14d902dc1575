// SPDX-License-Identifier: BSD-3-Clause
// One image shows two surfaces, both near enough to a plane to join it.
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_planes/growth/other_layers.h"

namespace vip_slam {
namespace {

/// Triangles of 10 x 10 cm at y = `at`, seen from below y; one in `every` belongs to the second surface.
std::vector<MapTriangle> wallWithBoard(double at, double board, int every, double sigma) {
  std::mt19937 random(2);
  std::normal_distribution<double> gauss(0, sigma);
  std::vector<MapTriangle> triangles;
  for (int i = 0; i < 400; ++i) {
    MapTriangle t;
    t.n = {0, -1, 0};
    t.centre = {0.1 * (i % 20), at - (i % every == 0 ? board : 0) + gauss(random), 0.1 * (i / 20)};
    t.area = 0.005, t.sigma = sigma, t.sigma_angle = 0.05;
    triangles.push_back(t);
  }
  return triangles;
}

std::vector<int> released(const std::vector<MapTriangle>& triangles) {
  const PlaneTrack wall(1, PlaneKind::kVertical, Plane({0, -1, 0}, 2.0), {0, 2, 0}, 0.1);
  std::vector<int> label(triangles.size(), 0), gone;
  const std::vector<PlaneId> beside = releaseOtherLayers(triangles, {&wall}, 0.02, &label);
  for (std::size_t i = 0; i < label.size(); ++i) {
    EXPECT_EQ(label[i] < 0 ? wall.id() : 0u, beside[i]) << i;
    if (label[i] < 0) gone.push_back(static_cast<int>(i));
  }
  return gone;
}

TEST(OtherLayers, ABoardBeforeTheWallIsReleased) {
  const std::vector<int> gone = released(wallWithBoard(2.0, 0.045, 3, 0.004));
  EXPECT_EQ(134u, gone.size());
  for (int i : gone) EXPECT_EQ(0, i % 3);
}

TEST(OtherLayers, APoseThatIsOffReleasesNothing) {
  for (double drift : {-0.04, 0.04}) EXPECT_TRUE(released(wallWithBoard(2.0 + drift, 0, 1, 0.004)).empty()) << drift;
}

TEST(OtherLayers, NeitherDoesAStepThatNoiseHidesNorAFewOutliers) {
  EXPECT_TRUE(released(wallWithBoard(2.0, 0.045, 3, 0.02)).empty());
  EXPECT_TRUE(released(wallWithBoard(2.0, 0.015, 3, 0.002)).empty());
  EXPECT_TRUE(released(wallWithBoard(2.0, 0.045, 20, 0.004)).empty());
}

}  // namespace
}  // namespace vip_slam
