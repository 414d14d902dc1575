// SPDX-License-Identifier: BSD-3-Clause
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_planes/growth/cell_grid.h"
#include "vip_slam_planes/growth/outline.h"

namespace vip_slam {
namespace {

void fill(CellGrid* grid, int x0, int y0, int x1, int y1, int hits = 1) {
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) grid->set({x, y}, hits);
}

double area(const std::vector<Outline>& outlines) {
  double sum = 0;
  for (const Outline& o : outlines) {
    sum += ringArea(o.outer);
    for (const Ring2d& h : o.holes) sum += ringArea(h);
  }
  return sum;
}

TEST(CellGrid, GrowsInAllDirections) {
  CellGrid grid;
  EXPECT_EQ(0, grid.at({5, 5}));
  grid.set({0, 0}, 1);
  grid.set({-40, 7}, 3);
  grid.set({25, -60}, 300);
  EXPECT_EQ(1, grid.at({0, 0}));
  EXPECT_EQ(3, grid.at({-40, 7}));
  EXPECT_EQ(255, grid.at({25, -60}));
  EXPECT_EQ(3, grid.count(1));
  EXPECT_EQ(2, grid.count(2));
  EXPECT_TRUE(grid.near({-42, 9}, 2));
  EXPECT_FALSE(grid.near({-43, 7}, 2));
}

TEST(CellGrid, CellsTooFarToStoreAreLeftOut) {
  CellGrid grid;
  grid.set({3, 4}, 2);
  for (const CellIndex far : {CellIndex{1 << 20, 1 << 20}, CellIndex{-2147483647, 4}, CellIndex{3, 2147483647}}) {
    grid.set(far, 1);
    EXPECT_EQ(0, grid.at(far));
    EXPECT_FALSE(grid.near(far, 5));
  }
  EXPECT_EQ(1, grid.count(1));
  EXPECT_EQ(2, grid.at({3, 4}));
  EXPECT_LT(grid.width() * grid.height(), 1000);
}

TEST(CellGrid, CountsAndVisitsWhatHasHits) {
  CellGrid grid;
  std::mt19937 random(3);
  std::uniform_int_distribution<int> place(-30, 30), hits(-1, 3);
  for (int i = 0; i < 3000; ++i) grid.set({place(random), place(random)}, hits(random));
  int all = 0, twice = 0, inside = 0, visited = 0;
  grid.forEach([&](CellIndex c, int h) {
    ++all;
    twice += h >= 2;
    inside += c.x >= -5 && c.x <= 8 && c.y >= 2 && c.y <= 100;
  });
  grid.forEachIn({-5, 2}, {8, 100}, [&](CellIndex c, int h) { visited += grid.at(c) == h; });
  EXPECT_GT(all, 1000);
  EXPECT_EQ(all, grid.count(1));
  EXPECT_EQ(twice, grid.count(2));
  EXPECT_EQ(inside, visited);
  grid.clear();
  EXPECT_EQ(0, grid.count(1));
}

TEST(CellGrid, TrianglesCoverTheCellsWithCentresInside) {
  // Two triangles tile a square: every centre is in one of them, whatever their orientation.
  int count = 0;
  const Eigen::Vector2d a(-0.52, -0.52), b(1.03, -0.52), c(1.03, 1.03), d(-0.52, 1.03);
  forCellsOfTriangle(a, b, c, 0.1, [&](CellIndex) { ++count; });
  forCellsOfTriangle(a, d, c, 0.1, [&](CellIndex cell) { count += cell.x != cell.y; });
  EXPECT_EQ(15 * 15, count);
}

TEST(Outline, DoorwayIsAHole) {
  CellGrid grid;
  fill(&grid, 0, 0, 50, 25);
  fill(&grid, 10, 3, 19, 21, 0);
  const auto outlines = traceOutlines(grid, 0.1, 1, 0.1, 0.1, 0.08);
  ASSERT_EQ(1u, outlines.size());
  ASSERT_EQ(1u, outlines[0].holes.size());
  EXPECT_EQ(4u, outlines[0].outer.size());
  EXPECT_EQ(4u, outlines[0].holes[0].size());
  EXPECT_NEAR(12.5, ringArea(outlines[0].outer), 1e-9);
  EXPECT_NEAR(-1.62, ringArea(outlines[0].holes[0]), 1e-9);
  EXPECT_TRUE(ringContains(outlines[0].outer, {0.05, 0.05}));
  EXPECT_FALSE(ringContains(outlines[0].outer, {5.2, 1}));
}

TEST(Outline, DoorwayToTheFloorIsPartOfTheOuterRing) {
  CellGrid grid;
  fill(&grid, 0, 0, 50, 25);
  fill(&grid, 10, 0, 19, 21, 0);
  const auto outlines = traceOutlines(grid, 0.1, 1, 0.1, 0.1, 0.08);
  ASSERT_EQ(1u, outlines.size());
  EXPECT_TRUE(outlines[0].holes.empty());
  EXPECT_EQ(8u, outlines[0].outer.size());
  EXPECT_NEAR(12.5 - 1.89, area(outlines), 1e-9);
}

TEST(Outline, PiecesIslandsAndDiagonalNeighbours) {
  CellGrid grid;
  fill(&grid, 0, 0, 20, 20);
  fill(&grid, 5, 5, 15, 15, 0);
  fill(&grid, 8, 8, 12, 12);    // an island in the hole
  fill(&grid, 20, 20, 30, 30);  // touches by a corner only
  const auto outlines = traceOutlines(grid, 0.1, 1, 0.05, 0.05, 0.02);
  ASSERT_EQ(3u, outlines.size());
  EXPECT_NEAR(4 - 1 + 0.16 + 1, area(outlines), 1e-9);
  int holes = 0;
  for (const Outline& o : outlines) holes += int(o.holes.size());
  EXPECT_EQ(1, holes);
}

TEST(Outline, DiagonalBorderIsSimplified) {
  CellGrid grid;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40 - y; ++x) grid.set({x, y}, 1);
  const auto outlines = traceOutlines(grid, 0.1, 1, 0.1, 0.1, 0.08);
  ASSERT_EQ(1u, outlines.size());
  EXPECT_LE(outlines[0].outer.size(), 5u);
  EXPECT_NEAR(8.2, area(outlines), 0.35);
}

TEST(Outline, MinimumHits) {
  CellGrid grid;
  fill(&grid, 0, 0, 10, 10, 1);
  fill(&grid, 0, 0, 5, 10, 2);
  EXPECT_NEAR(0.5, area(traceOutlines(grid, 0.1, 2, 0.05, 0.05, 0.08)), 1e-9);
  EXPECT_TRUE(traceOutlines(CellGrid(), 0.1, 1, 0.05, 0.05, 0.08).empty());
}

}  // namespace
}  // namespace vip_slam
