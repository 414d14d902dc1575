// SPDX-License-Identifier: BSD-3-Clause
// Re-acquires landmarks of the map that are in view but not tracked: projected with the corrected pose, matched by
// Hamming distance to the corners around and aligned with the patch of their old track, so that a track starts again
// with the landmark's id.
#pragma once

#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "vip_slam_core/types/map_update.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/landmark_index.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"

namespace vip_slam {

class LandmarkMatcher {
 public:
  LandmarkMatcher(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera);

  void apply(const MapUpdate& update);
  /// Keeps the patch of a track that ended, to re-acquire its landmark later.
  void retire(const Track& track);
  /// Adds a track for every landmark found again in the tracker's newest image; returns how many.
  int reacquire(FeatureTracker* tracker, const OrbExtractor& orb, const SE3& T_map_C, const SE3& T_odom_C) const;
  std::size_t size() const { return landmarks_.size(); }
  /// Forgets the map.
  void clear();
  /// Forgets the patches: their camera poses belong to an odometry epoch that has ended.
  void forgetPatches();

 private:
  struct Entry {
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
    std::uint32_t observations = 0;
    Descriptor descriptor{};
  };
  struct Patch {
    std::shared_ptr<const ReferenceImage> reference;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    PatchSurface surface;
    double reference_variance = 0;
    std::uint64_t number = 0;  ///< of its retirement
  };
  void erasePatch(LandmarkId id);

  TrackingOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  double reach_;  ///< m, search radius: from the camera to the corners of its view at the largest depth searched
  std::unordered_map<LandmarkId, Entry> landmarks_;
  LandmarkIndex index_;  ///< of landmarks_
  std::map<LandmarkId, Patch> patches_;
  std::map<std::uint64_t, LandmarkId> by_age_;  ///< ids in patches_ by Patch::number
  std::uint64_t retired_ = 0;
};

}  // namespace vip_slam
