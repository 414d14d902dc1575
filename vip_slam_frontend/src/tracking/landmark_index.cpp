// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/landmark_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vip_slam {
namespace {

std::int64_t keyOf(int x, int y) { return std::int64_t(x) * (std::int64_t(1) << 32) + y; }

}  // namespace

int LandmarkIndex::cellAlong(double x) const {
  using Range = std::numeric_limits<std::int16_t>;  // the last cells hold all that lies beyond
  return static_cast<int>(std::floor(std::clamp<double>(x / cell_, Range::min(), Range::max())));
}

void LandmarkIndex::put(LandmarkId id, const Eigen::Vector3d& p_map) {
  if (!p_map.allFinite()) {
    remove(id);
    return;
  }
  const std::int64_t cell = keyOf(cellAlong(p_map.x()), cellAlong(p_map.y()));
  const auto known = cell_of_.find(id);
  if (known != cell_of_.end()) {
    if (known->second == cell) return;
    remove(id);
  }
  cell_of_[id] = cell;
  cells_[cell].push_back(id);
}

void LandmarkIndex::remove(LandmarkId id) {
  const auto known = cell_of_.find(id);
  if (known == cell_of_.end()) return;
  std::vector<LandmarkId>& ids = cells_[known->second];
  ids.erase(std::remove(ids.begin(), ids.end(), id), ids.end());
  if (ids.empty()) cells_.erase(known->second);
  cell_of_.erase(known);
}

void LandmarkIndex::clear() {
  cells_.clear();
  cell_of_.clear();
}

std::vector<LandmarkId> LandmarkIndex::around(const Eigen::Vector3d& centre, double radius) const {
  std::vector<LandmarkId> ids;
  if (!centre.allFinite()) return ids;
  const int x0 = cellAlong(centre.x() - radius), x1 = cellAlong(centre.x() + radius);
  const int y0 = cellAlong(centre.y() - radius), y1 = cellAlong(centre.y() + radius);
  const auto take = [&ids](const std::vector<LandmarkId>& cell) { ids.insert(ids.end(), cell.begin(), cell.end()); };
  if ((x1 - x0 + 1.0) * (y1 - y0 + 1.0) >= static_cast<double>(cells_.size())) {
    for (const auto& cell : cells_) take(cell.second);
  } else {
    for (int x = x0; x <= x1; ++x) {
      for (int y = y0; y <= y1; ++y) {
        const auto cell = cells_.find(keyOf(x, y));
        if (cell != cells_.end()) take(cell->second);
      }
    }
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace vip_slam
