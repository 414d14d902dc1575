// SPDX-License-Identifier: BSD-3-Clause
// Finds landmarks of nearby keyframes again in a new keyframe: projection, pixel gate, Hamming distance. Untracked
// corners become observations; a tracked feature that has another landmark is the same point under a new track, and the
// two landmarks merge.
#pragma once

#include <functional>
#include <memory>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

struct ReobservationResult {
  int candidates = 0;  ///< landmarks that should be visible
  int found = 0;       ///< new observations
  int merged = 0;      ///< duplicate landmarks joined
};

class Reobservation {
 public:
  Reobservation(const ReobservationOptions& options, std::shared_ptr<const CameraModel> camera)
      : options_(options), camera_(std::move(camera)) {}
  /// `id` is in the map with its predicted or optimised pose.
  /// `allowed` names the keyframes whose landmarks may be looked for (empty: all).
  ReobservationResult process(KeyframeId id, Map* map, const std::function<bool(KeyframeId)>& allowed = {}) const;
  /// Keyframes whose landmarks are searched: covisible ones, then near ones with a similar viewing direction.
  std::vector<KeyframeId> neighbours(const Map& map, KeyframeId id,
                                     const std::function<bool(KeyframeId)>& allowed = {}) const;

 private:
  ReobservationOptions options_;
  std::shared_ptr<const CameraModel> camera_;
};

}  // namespace vip_slam
