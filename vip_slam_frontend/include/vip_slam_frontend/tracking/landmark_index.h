// Which landmarks of the map lie around a place: a building has hundreds of thousands, an image shows some hundred.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

class LandmarkIndex {
 public:
  /// A new landmark, or where it lies now; metres, in `map`. One that is not finite is left out.
  void put(LandmarkId id, const Eigen::Vector3d& p_map);
  void remove(LandmarkId id);
  void clear();
  /// Those within `radius` metres of `centre` in plan, and some beyond; ascending.
  std::vector<LandmarkId> around(const Eigen::Vector3d& centre, double radius) const;

 private:
  std::unordered_map<std::int64_t, std::vector<LandmarkId>> cells_;  ///< columns of space
  std::unordered_map<LandmarkId, std::int64_t> cell_of_;
};

}  // namespace vip_slam
