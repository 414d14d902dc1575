// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/geometry/polygon_triangulation.h"

#include <algorithm>
#include <limits>

namespace vip_slam {
namespace {

struct Vertex {
  Eigen::Vector2d at;
  Eigen::Vector3d point;
};
using Outline = std::vector<Vertex>;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return cross(b - a, c - b);
}

/// The ring in plane coordinates, counter-clockwise or clockwise as asked.
Outline flatten(const Ring& ring, const Eigen::Matrix<double, 3, 2>& axes, bool counter_clockwise) {
  Outline outline;
  outline.reserve(ring.size());
  for (const auto& point : ring) outline.push_back({axes.transpose() * point, point});
  double area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) area += cross(outline[i].at, outline[(i + 1) % outline.size()].at);
  if ((area > 0) != counter_clockwise) std::reverse(outline.begin(), outline.end());
  return outline;
}

bool segmentsCross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                   const Eigen::Vector2d& d) {
  return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
}

/// Joins the hole to the outline by the shortest bridge that crosses neither.
void bridge(const Outline& hole, Outline* outline) {
  struct Pair {
    double length;
    std::size_t outer, inner;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < outline->size(); ++i) {
    for (std::size_t j = 0; j < hole.size(); ++j) pairs.push_back({((*outline)[i].at - hole[j].at).norm(), i, j});
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.length < b.length; });
  const auto blocked = [](const Outline& ring, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    for (std::size_t k = 0; k < ring.size(); ++k) {
      if (segmentsCross(a, b, ring[k].at, ring[(k + 1) % ring.size()].at)) return true;
    }
    return false;
  };
  const auto open = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& p) {
    const Eigen::Vector2d &a = (*outline)[p.outer].at, &b = hole[p.inner].at;
    return !blocked(*outline, a, b) && !blocked(hole, a, b);
  });
  if (open == pairs.end()) return;  // a hole that crosses the outline is ignored
  Outline joined(outline->begin(), outline->begin() + std::ptrdiff_t(open->outer) + 1);
  for (std::size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(open->inner + k) % hole.size()]);
  joined.insert(joined.end(), outline->begin() + std::ptrdiff_t(open->outer), outline->end());
  *outline = std::move(joined);
}

bool inside(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return turn(a, b, p) > 0 && turn(b, c, p) > 0 && turn(c, a, p) > 0;
}

bool isEar(const Outline& outline, std::size_t i) {
  const std::size_t n = outline.size();
  const auto &a = outline[(i + n - 1) % n].at, &b = outline[i].at, &c = outline[(i + 1) % n].at;
  if (turn(a, b, c) <= 0) return false;
  return std::none_of(outline.begin(), outline.end(), [&](const Vertex& v) { return inside(v.at, a, b, c); });
}

}  // namespace

std::vector<Triangle> triangulate(const PlanePolygon& polygon, const Plane& plane) {
  Eigen::Matrix<double, 3, 2> axes = tangentBasis(plane.n);
  if (axes.col(0).cross(axes.col(1)).dot(plane.n) < 0) axes.col(0).swap(axes.col(1));
  std::vector<Triangle> triangles;
  if (polygon.outer.size() < 3) return triangles;
  Outline outline = flatten(polygon.outer, axes, true);
  for (const Ring& hole : polygon.holes) {
    if (hole.size() >= 3) bridge(flatten(hole, axes, false), &outline);
  }
  while (outline.size() >= 3) {
    const std::size_t n = outline.size();
    std::size_t ear = 0;
    while (ear < n && !isEar(outline, ear)) ++ear;
    // No ear: the rest is degenerate or crosses itself. Remove the flattest corner, with or without a triangle.
    const bool found = ear < n;
    if (!found) {
      double flattest = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < n; ++i) {
        const double t = std::abs(turn(outline[(i + n - 1) % n].at, outline[i].at, outline[(i + 1) % n].at));
        if (t < flattest) {
          flattest = t;
          ear = i;
        }
      }
    }
    if (found)
      triangles.push_back({outline[(ear + n - 1) % n].point, outline[ear].point, outline[(ear + 1) % n].point});
    outline.erase(outline.begin() + std::ptrdiff_t(ear));
  }
  return triangles;
}

}  // namespace vip_slam
