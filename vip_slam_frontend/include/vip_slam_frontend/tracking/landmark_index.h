// SPDX-License-Identifier: BSD-3-Clause
// Spatial index of the map's landmarks: a building has hundreds of thousands, an image shows some hundred.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

class LandmarkIndex {
 public:
  /// `cell`: width of its cells, m; about as wide as the radius of most searches.
  explicit LandmarkIndex(double cell) : cell_(cell) {}

  /// Adds or moves a landmark; metres, in `map`. A position that is not finite removes it.
  void put(LandmarkId id, const Eigen::Vector3d& p_map);
  void remove(LandmarkId id);
  void clear();
  /// Landmarks within `radius` metres of `centre` horizontally, and some beyond; ids ascending.
  std::vector<LandmarkId> around(const Eigen::Vector3d& centre, double radius) const;

 private:
  int cellAlong(double x) const;

  double cell_;
  std::unordered_map<std::int64_t, std::vector<LandmarkId>> cells_;  ///< vertical columns of space
  std::unordered_map<LandmarkId, std::int64_t> cell_of_;
};

}  // namespace vip_slam
