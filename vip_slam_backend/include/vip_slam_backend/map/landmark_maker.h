// SPDX-License-Identifier: BSD-3-Clause
// Landmarks from a new keyframe: known tracks gain an observation, new tracks become landmarks by depth, tracks without
// depth wait until two keyframes see them under enough parallax.
#pragma once

#include <functional>
#include <unordered_map>
#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

class LandmarkMaker {
 public:
  explicit LandmarkMaker(double focal_px) : focal_(focal_px) {}
  /// Handles all tracked features of a keyframe that is in the map. Returns the number of new landmarks. `allowed`: the
  /// keyframes whose landmarks may gain observations (empty: all); a track with the id of any other landmark gets none.
  int process(KeyframeId id, Map* map, const std::function<bool(KeyframeId)>& allowed = {});
  void clear() { waiting_.clear(); }

 private:
  bool triangulate(const Map& map, const std::vector<MapObservation>& views, Eigen::Vector3d* p_W) const;

  double focal_;  ///< px
  std::unordered_map<LandmarkId, std::vector<MapObservation>> waiting_;
};

}  // namespace vip_slam
