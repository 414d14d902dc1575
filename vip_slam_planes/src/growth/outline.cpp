// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/outline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vip_slam {
namespace {

// Directions of travel along cell corners, covered cells on the left: east, north, west, south.
constexpr int kDx[4] = {1, 0, -1, 0}, kDy[4] = {0, 1, 0, -1};

class Tracer {
 public:
  Tracer(const CellGrid& grid, int min_hits)
      : x0_(grid.x0()),
        y0_(grid.y0()),
        width_(grid.width() + 1),
        height_(grid.height() + 1),
        covered_(static_cast<std::size_t>(width_ + 1) * (height_ + 1), 0),
        done_(static_cast<std::size_t>(width_) * height_, 0) {
    for (int y = y0_; y < y0_ + grid.height(); ++y) {
      const std::uint8_t* hits = grid.row(y);
      unsigned char* covered = &covered_[cell(x0_, y)];
      for (int i = 0; i < grid.width(); ++i) covered[i] = hits[i] >= min_hits;
    }
  }

  std::vector<std::vector<CellIndex>> rings() {
    std::vector<std::vector<CellIndex>> all;
    for (int y = y0_; y < y0_ + height_; ++y) {
      const unsigned char *below = &covered_[cell(x0_ - 1, y - 1)], *above = &covered_[cell(x0_ - 1, y)];
      for (int i = 0; i < width_; ++i) {
        const int around = below[i] + below[i + 1] + above[i] + above[i + 1];
        if (around == 0 || around == 4) continue;
        const CellIndex c{x0_ + i, y};
        for (int direction = 0; direction < 4; ++direction) {
          if (border(c, direction) && !done(c, direction)) all.push_back(follow(c, direction));
        }
      }
    }
    return all;
  }

 private:
  // A margin of one empty cell all around avoids bounds checks.
  std::size_t cell(int x, int y) const {
    return static_cast<std::size_t>(y - y0_ + 1) * (width_ + 1) + static_cast<std::size_t>(x - x0_ + 1);
  }
  bool covered(int x, int y) const { return covered_[cell(x, y)]; }
  // A step from corner (x, y) is a border when the cell on its left is covered and the one on its right is not.
  bool border(CellIndex c, int direction) const {
    switch (direction) {
      case 0:
        return covered(c.x, c.y) && !covered(c.x, c.y - 1);
      case 1:
        return covered(c.x - 1, c.y) && !covered(c.x, c.y);
      case 2:
        return covered(c.x - 1, c.y - 1) && !covered(c.x - 1, c.y);
      default:
        return covered(c.x, c.y - 1) && !covered(c.x - 1, c.y - 1);
    }
  }
  bool done(CellIndex c, int direction) const { return done_[corner(c)] >> direction & 1; }
  std::size_t corner(CellIndex c) const {
    return static_cast<std::size_t>(c.y - y0_) * width_ + static_cast<std::size_t>(c.x - x0_);
  }
  std::vector<CellIndex> follow(CellIndex c, int direction) {
    std::vector<CellIndex> ring;
    int last = -1;
    while (!done(c, direction)) {
      done_[corner(c)] |= static_cast<unsigned char>(1 << direction);
      if (direction != last) ring.push_back(c);
      last = direction;
      c.x += kDx[direction];
      c.y += kDy[direction];
      // Turn left first where two borders cross: diagonal cells then belong to different rings (4-connected).
      for (int turn : {1, 0, 3}) {
        if (border(c, (direction + turn) % 4)) {
          direction = (direction + turn) % 4;
          break;
        }
      }
    }
    return ring;
  }

  int x0_, y0_, width_, height_;  ///< of the corners
  std::vector<unsigned char> covered_, done_;
};

double distanceToSegment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double s = ab.squaredNorm() > 0 ? std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - a - s * ab).norm();
}

// Douglas-Peucker between ring[first] and ring[last] (last may be ring.size(): the first point again).
void simplify(const Ring2d& ring, std::size_t first, std::size_t last, double tolerance, std::vector<char>* keep) {
  std::vector<std::pair<std::size_t, std::size_t>> open{{first, last}};
  while (!open.empty()) {
    const auto [a, b] = open.back();
    open.pop_back();
    double worst = tolerance;
    std::size_t at = 0;
    for (std::size_t i = a + 1; i < b; ++i) {
      const double d = distanceToSegment(ring[i], ring[a], ring[b % ring.size()]);
      if (d > worst) worst = d, at = i;
    }
    if (at == 0) continue;
    (*keep)[at] = 1;
    open.push_back({a, at});
    open.push_back({at, b});
  }
}

Ring2d simplified(const Ring2d& ring, double tolerance) {
  if (ring.size() <= 4) return ring;
  // Anchored at two opposite extreme corners, which are true corners of the shape wherever the trace starts.
  std::size_t a = 0, b = 0;
  for (std::size_t i = 1; i < ring.size(); ++i) {
    if (ring[i].sum() < ring[a].sum()) a = i;
  }
  Ring2d turned(ring.begin() + a, ring.end());
  turned.insert(turned.end(), ring.begin(), ring.begin() + a);
  for (std::size_t i = 1; i < turned.size(); ++i) {
    if ((turned[i] - turned[0]).squaredNorm() > (turned[b] - turned[0]).squaredNorm()) b = i;
  }
  std::vector<char> keep(turned.size(), 0);
  keep[0] = keep[b] = 1;
  simplify(turned, 0, b, tolerance, &keep);
  simplify(turned, b, turned.size(), tolerance, &keep);
  Ring2d result;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    if (keep[i]) result.push_back(turned[i]);
  }
  return result.size() >= 3 ? result : ring;
}

}  // namespace

double ringArea(const Ring2d& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

bool ringContains(const Ring2d& ring, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Eigen::Vector2d &a = ring[i], &b = ring[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) {
      inside = !inside;
    }
  }
  return inside;
}

std::vector<Outline> traceOutlines(const CellGrid& grid, double cell, int min_hits, double min_area, double min_hole,
                                   double tolerance) {
  std::vector<Ring2d> outers, holes;
  if (grid.empty()) return {};
  for (const std::vector<CellIndex>& corners : Tracer(grid, std::max(1, min_hits)).rings()) {
    Ring2d ring;
    for (const CellIndex& c : corners) ring.push_back(Eigen::Vector2d(c.x * cell, c.y * cell));
    const double area = ringArea(ring);
    if (area >= min_area) outers.push_back(std::move(ring));
    if (-area >= min_hole) holes.push_back(std::move(ring));
  }
  std::vector<Outline> outlines(outers.size());
  for (const Ring2d& hole : holes) {
    // The point half a cell into the covered side of the first border lies in the piece that owns the hole.
    const Eigen::Vector2d along = (hole[1] - hole[0]).normalized();
    const Eigen::Vector2d probe = hole[0] + 0.5 * cell * (along + Eigen::Vector2d(-along.y(), along.x()));
    std::size_t owner = outers.size();  // the smallest: an island's ring also lies inside the piece around it
    for (std::size_t i = 0; i < outers.size(); ++i) {
      if (ringContains(outers[i], probe) && (owner == outers.size() || ringArea(outers[i]) < ringArea(outers[owner]))) {
        owner = i;
      }
    }
    if (owner < outers.size()) outlines[owner].holes.push_back(simplified(hole, tolerance));
  }
  for (std::size_t i = 0; i < outers.size(); ++i) outlines[i].outer = simplified(outers[i], tolerance);
  return outlines;
}

}  // namespace vip_slam
