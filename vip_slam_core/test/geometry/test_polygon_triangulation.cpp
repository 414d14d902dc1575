// SPDX-License-Identifier: BSD-3-Clause
// The triangles cover the polygon: their areas add up to it and their normals are the plane's.
#include <cmath>

#include <gtest/gtest.h>

#include "vip_slam_core/geometry/polygon_triangulation.h"

namespace vip_slam {
namespace {

const Plane kTilted(Eigen::Vector3d(1, 2, 3), -0.7);

/// Plane coordinates to space.
Ring lift(const std::vector<Eigen::Vector2d>& points) {
  const auto axes = tangentBasis(kTilted.n);
  Ring ring;
  for (const auto& p : points) ring.push_back(axes * p - kTilted.d * kTilted.n);
  return ring;
}

double totalArea(const std::vector<Triangle>& triangles) {
  double area = 0;
  for (const auto& t : triangles) {
    const Eigen::Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    EXPECT_GE(normal.dot(kTilted.n), -1e-12);
    area += 0.5 * normal.norm();
  }
  return area;
}

TEST(Triangulate, ConcavePolygonEitherWayRound) {
  const std::vector<Eigen::Vector2d> l_shape = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {0, 2}};
  EXPECT_NEAR(totalArea(triangulate({lift(l_shape), {}}, kTilted)), 4.0, 1e-9);
  EXPECT_NEAR(totalArea(triangulate({lift({l_shape.rbegin(), l_shape.rend()}), {}}, kTilted)), 4.0, 1e-9);
}

TEST(Triangulate, HolesAreCutOut) {
  const Ring outer = lift({{0, 0}, {6, 0}, {6, 4}, {0, 4}});
  const Ring door = lift({{1, 1}, {2, 1}, {2, 3}, {1, 3}}), window = lift({{4, 3}, {5, 3}, {5, 2}, {4, 2}});
  EXPECT_NEAR(totalArea(triangulate({outer, {door, window}}, kTilted)), 24 - 2 - 1, 1e-9);
}

TEST(Triangulate, ManyCorners) {
  std::vector<Eigen::Vector2d> star;
  double expected = 0;
  for (int i = 0; i < 200; ++i) {
    const double a = 2 * M_PI * i / 200, r = i % 2 ? 1.0 : 2.0;
    star.emplace_back(r * std::cos(a), r * std::sin(a));
    expected += 0.5 * 1.0 * 2.0 * std::sin(2 * M_PI / 200);
  }
  EXPECT_NEAR(totalArea(triangulate({lift(star), {}}, kTilted)), expected, 1e-9);
}

TEST(Triangulate, DegenerateRingsEnd) {
  EXPECT_TRUE(triangulate({lift({{0, 0}, {1, 0}}), {}}, kTilted).empty());
  EXPECT_LT(totalArea(triangulate({lift({{0, 0}, {1, 0}, {2, 0}, {3, 0}}), {}}, kTilted)), 1e-12);
  triangulate({lift({{0, 0}, {1, 1}, {1, 0}, {0, 1}}), {}}, kTilted);
}

}  // namespace
}  // namespace vip_slam
