// SPDX-License-Identifier: BSD-3-Clause
// Relocalisation: finds a keyframe in the map without a prior pose (after LOST, in a loaded map, in localisation-only
// mode). See loop/place_search.h for the reasons of a refusal.
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

  /// By appearance of this keyframe and those given before it. Empty when no place fits, or more than one; `reason`
  /// (may be null) explains the result.
  std::optional<Relocalisation> relocalise(const Map& map, const LoopCloser& places, const KeyframePtr& keyframe,
                                           const std::function<bool(KeyframeId)>& allowed = {},
                                           std::string* reason = nullptr);
  /// From a predicted pose: guided matching of the landmarks around the nearest of the keyframes allowed.
  std::optional<Relocalisation> track(const Map& map, const LoopCloser& places, const Keyframe& keyframe,
                                      const SE3& T_W_I, const std::function<bool(KeyframeId)>& allowed = {}) const;
  /// Forgets the earlier keyframes, when the map or the odometry has changed.
  void clear() { search_.clear(); }

 private:
  PlaceSearch search_;
};

}  // namespace vip_slam
