// Where in the map is this keyframe? Without any prior pose: after LOST, in a loaded map, in localisation-only mode.
// See loop/place_search.h for what makes it refuse.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "vip_slam_backend/loop/loop_closer.h"

namespace vip_slam {

struct Relocalisation {
  KeyframeId match = 0;
  SE3 T_W_I;
  int inliers = 0;
  std::vector<std::pair<std::uint32_t, LandmarkId>> landmarks;  ///< feature of the query, landmark of the map
};

class Relocaliser {
 public:
  explicit Relocaliser(const RelocalisationOptions& options) : search_(options) {}

  /// By appearance, of this keyframe and those given before it. Empty when no place fits, or two do; `reason` (may be
  /// null) says what was seen.
  std::optional<Relocalisation> relocalise(const Map& map, const LoopCloser& places, const KeyframePtr& keyframe,
                                           const std::function<bool(KeyframeId)>& allowed = {},
                                           std::string* reason = nullptr);
  /// From a predicted pose: the landmarks around it are looked for at once, at the nearest of the keyframes allowed.
  std::optional<Relocalisation> track(const Map& map, const LoopCloser& places, const Keyframe& keyframe,
                                      const SE3& T_W_I, const std::function<bool(KeyframeId)>& allowed = {}) const;
  /// Forgets the keyframes before (another map, another odometry).
  void clear() { search_.clear(); }

 private:
  PlaceSearch search_;
};

}  // namespace vip_slam
