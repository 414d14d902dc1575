// Landmarks from a new keyframe: known tracks gain an observation, new tracks become landmarks by depth, tracks without
// depth wait until two keyframes see them under enough parallax.
#pragma once

#include <functional>
#include <unordered_map>
#include <vector>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

struct LandmarkMakerOptions {
  double gate_px = 12.0;          ///< a known track farther than this from its projection starts anew
  double min_parallax_deg = 1.0;  ///< for triangulation
  double focal = 500;             ///< px
};

class LandmarkMaker {
 public:
  explicit LandmarkMaker(const LandmarkMakerOptions& options) : options_(options) {}
  /// Handles all tracked features of a keyframe that is in the map. Returns the number of new landmarks. `allowed`
  /// names the keyframes whose landmarks may be met (empty: all); a track that bears the name of another one has no
  /// landmark.
  int process(KeyframeId id, Map* map, const std::function<bool(KeyframeId)>& allowed = {});
  void clear() { waiting_.clear(); }

 private:
  bool triangulate(const Map& map, const std::vector<MapObservation>& views, Eigen::Vector3d* p_W) const;

  LandmarkMakerOptions options_;
  std::unordered_map<LandmarkId, std::vector<MapObservation>> waiting_;
};

}  // namespace vip_slam
