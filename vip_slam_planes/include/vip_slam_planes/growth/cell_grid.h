// SPDX-License-Identifier: BSD-3-Clause
// A plane's covered area as square cells of its own 2D frame, each with the number of sightings (saturating).
// Memory depends on the covered area, not on the number of frames; area, containment, overlap and polygons are computed
// from it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

struct CellIndex {
  int x = 0, y = 0;
  bool operator==(const CellIndex& o) const { return x == o.x && y == o.y; }
};

/// Largest count of sightings of a cell: small enough that a surface which was removed is forgotten after as many
/// sightings of the surface behind it.
constexpr int kMaxHits = 8;

class CellGrid {
 public:
  int at(CellIndex c) const {
    const std::int64_t i = std::int64_t(c.x) - x0_, j = std::int64_t(c.y) - y0_;
    return i < 0 || j < 0 || i >= width_ || j >= height_ ? 0 : hits_[static_cast<std::size_t>(j * width_ + i)];
  }
  /// Grows as needed; a cell too far away to store (some 800 m at 10 cm) stays empty.
  void set(CellIndex c, int hits);
  /// Number of cells with at least `min_hits`.
  int count(int min_hits) const;
  /// True when a cell within `reach` (Chebyshev) has at least one hit.
  bool near(CellIndex c, int reach) const;
  /// Whether one of its four neighbours has none.
  bool isBorder(CellIndex c) const {
    return !at({c.x - 1, c.y}) || !at({c.x + 1, c.y}) || !at({c.x, c.y - 1}) || !at({c.x, c.y + 1});
  }
  bool empty() const { return covered_ == 0; }
  void clear();

  // Bounds of the stored rectangle: [x0, x0 + width) x [y0, y0 + height).
  int x0() const { return x0_; }
  int y0() const { return y0_; }
  int width() const { return width_; }
  int height() const { return height_; }

  /// Hits of the stored row y, from x0 on.
  const std::uint8_t* row(int y) const { return hits_.data() + static_cast<std::size_t>(y - y0_) * width_; }

  /// f(CellIndex, hits) for every cell with hits, row by row.
  template <class F>
  void forEach(F f) const {
    forEachIn({x0_, y0_}, {x0_ + width_ - 1, y0_ + height_ - 1}, f);
  }
  /// The same for the cells from `first` to `last`, both included.
  template <class F>
  void forEachIn(CellIndex first, CellIndex last, F f) const {
    const int i0 = std::max(0, first.x - x0_), i1 = std::min(width_ - 1, last.x - x0_);
    const int j0 = std::max(0, first.y - y0_), j1 = std::min(height_ - 1, last.y - y0_);
    for (int j = j0; j <= j1; ++j) {
      const std::uint8_t* row = hits_.data() + static_cast<std::size_t>(j) * width_;
      for (int i = i0; i <= i1; ++i) {
        if (row[i]) f(CellIndex{x0_ + i, y0_ + j}, int(row[i]));
      }
    }
  }

  /// Covers single empty cells between covered opposite neighbours (re-sampling leaves such pinholes), if
  /// `was_covered` confirms that the cell was covered before the re-sampling.
  void closePinholes(const std::function<bool(CellIndex)>& was_covered);

 private:
  bool cover(CellIndex c);

  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
  int covered_ = 0;  ///< cells with hits
  std::vector<std::uint8_t> hits_;
};

/// Calls f(CellIndex) for the cells (side `cell`, metres) whose centre lies in the triangle abc of the plane.
template <class F>
void forCellsOfTriangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double cell,
                        F f) {
  // Half the triangles cover no cell centre, so most of the time is spent on the bounds: keep them cheap.
  const auto first = [cell](double low) {
    const double q = low / cell - 0.5;
    const int i = static_cast<int>(q);
    return i < q ? i + 1 : i;
  };
  const int x0 = first(std::min({a.x(), b.x(), c.x()})), y0 = first(std::min({a.y(), b.y(), c.y()}));
  const double x1 = std::max({a.x(), b.x(), c.x()}) / cell, y1 = std::max({a.y(), b.y(), c.y()}) / cell;
  if (x0 + 0.5 > x1 || y0 + 0.5 > y1) return;
  // A side from p along s has the centre q on its left when s.x (q - p).y >= s.y (q - p).x.
  struct Side {
    double px, py, sx, sy;
  };
  const double turn = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()) < 0 ? -1.0 : 1.0;
  const auto side = [turn](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return Side{p.x(), p.y(), turn * (q.x() - p.x()), turn * (q.y() - p.y())};
  };
  const Side ab = side(a, b), bc = side(b, c), ca = side(c, a);
  for (int y = y0; y + 0.5 <= y1; ++y) {
    const double cy = (y + 0.5) * cell;
    const double up_ab = ab.sx * (cy - ab.py), up_bc = bc.sx * (cy - bc.py), up_ca = ca.sx * (cy - ca.py);
    for (int x = x0; x + 0.5 <= x1; ++x) {
      const double cx = (x + 0.5) * cell;
      if (up_ab >= ab.sy * (cx - ab.px) && up_bc >= bc.sy * (cx - bc.px) && up_ca >= ca.sy * (cx - ca.px)) {
        f(CellIndex{x, y});
      }
    }
  }
}

}  // namespace vip_slam
