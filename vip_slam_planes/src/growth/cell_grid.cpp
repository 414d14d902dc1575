// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/cell_grid.h"

#include <algorithm>
#include <cstdlib>

namespace vip_slam {

bool CellGrid::cover(CellIndex c) {
  // 64 MB, 800 m x 800 m of cells of 10 cm: cells beyond must be due to a wrong pose.
  constexpr std::int64_t kMaxCells = 1 << 26;
  if (std::abs(std::int64_t(c.x)) > kMaxCells || std::abs(std::int64_t(c.y)) > kMaxCells) return false;
  if (hits_.empty()) {
    x0_ = c.x, y0_ = c.y, width_ = height_ = 1;
    hits_.assign(1, 0);
    return true;
  }
  if (c.x >= x0_ && c.y >= y0_ && c.x < x0_ + width_ && c.y < y0_ + height_) return true;
  const int x0 = std::min(x0_, c.x), y0 = std::min(y0_, c.y);
  const int x1 = std::max(x0_ + width_, c.x + 1), y1 = std::max(y0_ + height_, c.y + 1);
  if (std::int64_t(x1 - x0) * (y1 - y0) > kMaxCells) return false;
  std::vector<std::uint8_t> hits(static_cast<std::size_t>(x1 - x0) * (y1 - y0), 0);
  for (int j = 0; j < height_; ++j) {
    std::copy_n(hits_.begin() + static_cast<std::size_t>(j) * width_, width_,
                hits.begin() + static_cast<std::size_t>(j + y0_ - y0) * (x1 - x0) + (x0_ - x0));
  }
  hits_ = std::move(hits);
  x0_ = x0, y0_ = y0, width_ = x1 - x0, height_ = y1 - y0;
  return true;
}

void CellGrid::set(CellIndex c, int hits) {
  if ((hits == 0 && at(c) == 0) || !cover(c)) return;
  std::uint8_t& cell = hits_[static_cast<std::size_t>(c.y - y0_) * width_ + (c.x - x0_)];
  covered_ -= cell > 0;
  cell = static_cast<std::uint8_t>(std::clamp(hits, 0, 255));
  covered_ += cell > 0;
}

int CellGrid::count(int min_hits) const {
  if (min_hits == 1) return covered_;  // needed several times per keyframe and plane
  return static_cast<int>(std::count_if(hits_.begin(), hits_.end(), [&](int h) { return h >= min_hits; }));
}

bool CellGrid::near(CellIndex c, int reach) const {
  const std::int64_t cx = c.x, cy = c.y;  // any int: the sums must not overflow
  const std::int64_t xa = std::max<std::int64_t>(cx - reach, x0_), ya = std::max<std::int64_t>(cy - reach, y0_);
  const std::int64_t xb = std::min<std::int64_t>(cx + reach, x0_ + width_ - 1);
  const std::int64_t yb = std::min<std::int64_t>(cy + reach, y0_ + height_ - 1);
  for (std::int64_t y = ya; y <= yb; ++y) {
    const std::uint8_t* row = hits_.data() + static_cast<std::size_t>(y - y0_) * width_ - x0_;
    for (std::int64_t x = xa; x <= xb; ++x) {
      if (row[x]) return true;
    }
  }
  return false;
}

void CellGrid::clear() {
  hits_.clear();
  x0_ = y0_ = width_ = height_ = covered_ = 0;
}

void CellGrid::closePinholes(const std::function<bool(CellIndex)>& was_covered) {
  std::vector<std::pair<CellIndex, int>> holes;
  for (int y = y0_; y < y0_ + height_; ++y) {
    for (int x = x0_; x < x0_ + width_; ++x) {
      if (at({x, y})) continue;
      const int across = std::min(at({x - 1, y}), at({x + 1, y})), along = std::min(at({x, y - 1}), at({x, y + 1}));
      if ((across || along) && was_covered({x, y})) holes.push_back({{x, y}, std::max(across, along)});
    }
  }
  for (const auto& [c, h] : holes) set(c, h);
}

}  // namespace vip_slam
