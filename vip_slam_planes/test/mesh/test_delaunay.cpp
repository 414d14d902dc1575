// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "vip_slam_planes/mesh/delaunay.h"

namespace vip_slam {
namespace {

double area2(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c) {
  const Eigen::Vector2d u = (b - a).cast<double>(), v = (c - a).cast<double>();
  return u.x() * v.y() - u.y() * v.x();
}

// Neighbours agree both ways, areas are positive and sum up to the hull's.
void expectConsistent(const std::vector<DelaunayTriangle>& triangles, const std::vector<Eigen::Vector2f>& points,
                      double expected_area) {
  double sum = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const DelaunayTriangle& t = triangles[i];
    const double a = area2(points[t.vertex[0]], points[t.vertex[1]], points[t.vertex[2]]);
    EXPECT_GT(a, 0);
    sum += 0.5 * a;
    for (int k = 0; k < 3; ++k) {
      const int g = t.neighbour[k];
      if (g < 0) continue;
      const DelaunayTriangle& n = triangles[g];
      EXPECT_EQ(1, std::count(n.neighbour.begin(), n.neighbour.end(), int(i)));
      for (int j = 1; j < 3; ++j) {
        EXPECT_EQ(1, std::count(n.vertex.begin(), n.vertex.end(), t.vertex[(k + j) % 3]));
      }
    }
  }
  EXPECT_NEAR(expected_area, sum, 1e-3 * expected_area);
}

TEST(Delaunay, RegularGridWithAllCirclesDegenerate) {
  std::vector<Eigen::Vector2f> points;
  for (int r = 0; r < 30; ++r)
    for (int c = 0; c < 40; ++c) points.emplace_back(4 + 16 * c, 4 + 16 * r);
  Delaunay delaunay;
  const auto& triangles = delaunay.triangulate(points, 640, 480);
  EXPECT_EQ(std::size_t(2 * 29 * 39), triangles.size());
  expectConsistent(triangles, points, 39 * 16.0 * 29 * 16.0);
}

TEST(Delaunay, EmptyCirclesOfRandomPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(0, 639), v(0, 479);
  std::vector<Eigen::Vector2f> points;
  for (int i = 0; i < 400; ++i) points.emplace_back(std::round(u(random) * 8) / 8, std::round(v(random) * 8) / 8);
  Delaunay delaunay;
  const auto& triangles = delaunay.triangulate(points, 640, 480);
  ASSERT_GT(triangles.size(), 700u);
  for (const DelaunayTriangle& t : triangles) {
    const Eigen::Vector2d a = points[t.vertex[0]].cast<double>(), b = points[t.vertex[1]].cast<double>(),
                          c = points[t.vertex[2]].cast<double>();
    Eigen::Matrix2d A;
    A << (b - a).transpose(), (c - a).transpose();
    const Eigen::Vector2d centre = A.inverse() * Eigen::Vector2d(0.5 * (b.squaredNorm() - a.squaredNorm()),
                                                                 0.5 * (c.squaredNorm() - a.squaredNorm()));
    const double radius = (a - centre).norm();
    for (const Eigen::Vector2f& p : points) EXPECT_GT((p.cast<double>() - centre).norm(), radius * (1 - 1e-7) - 1e-6);
  }
}

TEST(Delaunay, RepeatedOutsideAndNonFinitePointsTakeNoPart) {
  std::vector<Eigen::Vector2f> points{{10, 10}, {100, 10}, {10, 100}, {10, 10}, {-5, 20}, {700, 20}, {50, 10}};
  points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 3.0f);
  points.emplace_back(55.0f, 55.0f);  // on the long side
  Delaunay delaunay;
  const auto& triangles = delaunay.triangulate(points, 640, 480);
  std::set<int> used;
  for (const auto& t : triangles) used.insert(t.vertex.begin(), t.vertex.end());
  EXPECT_EQ((std::set<int>{0, 1, 2, 6, 8}), used);
  expectConsistent(triangles, points, 0.5 * 90 * 90);
}

TEST(Delaunay, FewerThanThreePointsAndBadSizes) {
  Delaunay delaunay;
  EXPECT_TRUE(delaunay.triangulate({}, 640, 480).empty());
  EXPECT_TRUE(delaunay.triangulate({{1, 1}, {5, 5}}, 640, 480).empty());
  EXPECT_TRUE(delaunay.triangulate({{1, 1}, {5, 5}, {9, 9}}, 640, 480).empty());
  EXPECT_THROW(delaunay.triangulate({}, 0, 480), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
