// SPDX-License-Identifier: BSD-3-Clause
// Delaunay triangulation of image points (Bowyer-Watson, incremental).
// Coordinates are rounded to a fixed sub-pixel lattice so that orientation and in-circle tests are exact in 64-bit
// integers: regular grids, with four points on a circle everywhere, are handled without tolerances.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

/// Indices into the points; neighbour[k] lies across the side opposite vertex[k], -1 at the hull.
/// Vertices run counter-clockwise for x right, y up (clockwise on the screen).
struct DelaunayTriangle {
  std::array<int, 3> vertex;
  std::array<int, 3> neighbour;
};

/// Keeps its memory between calls. Points outside [0, width) x [0, height), not finite, or closer than the lattice
/// (1/8 px up to 2000 px) to an earlier one are ignored. Throws std::invalid_argument when width or height is outside
/// 1..16000.
class Delaunay {
 public:
  const std::vector<DelaunayTriangle>& triangulate(const std::vector<Eigen::Vector2f>& points, int width, int height);

 private:
  struct Point {
    std::int64_t x, y;
  };
  struct Face {
    std::array<int, 3> vertex;
    std::array<int, 3> neighbour;
    bool alive;
    int visited;
  };

  void start(int width, int height);
  void insert(int vertex);
  int locate(const Point& p) const;
  bool inCircle(const Face& face, const Point& p) const;
  static std::int64_t orient(const Point& a, const Point& b, const Point& c);
  int newFace();

  std::int64_t scale_ = 8;
  std::vector<Point> points_;  ///< four corners of an enclosing box, then the input
  std::vector<Face> faces_;
  std::vector<int> free_, cavity_, stack_, face_from_;
  struct Side {
    int a, b, outside;
  };
  std::vector<Side> rim_;
  int last_ = 0, stamp_ = 0;
  std::vector<DelaunayTriangle> result_;
};

}  // namespace vip_slam
