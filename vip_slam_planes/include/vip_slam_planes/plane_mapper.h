// SPDX-License-Identifier: BSD-3-Clause
// The plane module (paper section "Plane Detection and Association"). ROS-free; one owner thread.
//
// Keyframes are added with addKeyframe() and wait until a MapUpdate places them in `map`; tracked frames only grow
// existing planes. All output is in `map`. Normals point to the side that a plane was seen from, so that the two faces
// of a door are two planes. Epochs of the odometry that are not tied by an accepted loop of a MapUpdate have separate
// planes.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

/// Counted since construction; for diagnostics.
struct PlaneMapperCounters {
  std::uint64_t keyframes = 0;            ///< placed and processed
  std::uint64_t keyframes_waiting = 0;    ///< not placed yet
  std::uint64_t keyframes_forgotten = 0;  ///< dropped, since the back end never placed them
  std::uint64_t frames_grown = 0, frames_skipped = 0;
  std::uint64_t planes_started = 0, planes_merged = 0, planes_removed = 0;
  std::uint64_t points_associated = 0, points_dissociated = 0, point_candidates = 0;
};

class PlaneMapper {
 public:
  /// Throws std::invalid_argument when the camera is null or the depth noise unusable. `timing` may be null and must
  /// outlive this.
  PlaneMapper(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera, const DepthNoise& noise,
              TimingLog* timing = nullptr);
  ~PlaneMapper();
  PlaneMapper(const PlaneMapper&) = delete;
  PlaneMapper& operator=(const PlaneMapper&) = delete;

  /// Stores the keyframe until a MapUpdate places it. Ignores a null keyframe, a known id, or a depth grid with an
  /// inconsistent size.
  void addKeyframe(KeyframePtr keyframe);
  /// At image rate: extends existing planes; starts none. Does nothing without depth, while not tracking, or when the
  /// frame belongs to another epoch than the newest keyframe.
  void grow(const TrackedFrame& frame, const SE3& T_map_odom);
  /// Applies the corrections, then detects, associates and merges with the keyframes that are now placed. Poses, planes
  /// and landmarks that are not finite are ignored. A wall whose observations no longer agree is reported as removed,
  /// and may return with the same id. Planes do not change from an update that removes a waiting keyframe
  /// (localisation-only mode of the back end) until one that places a keyframe or is global.
  PlaneUpdate applyMapUpdate(const MapUpdate& update);
  /// Confirmed planes, by id; polygons of the last applyMapUpdate().
  const std::vector<PlaneEstimate>& planes() const;
  /// Starts from the planes of a loaded map; all earlier state is discarded. Planes without area, or not finite, are
  /// reported as removed by the next applyMapUpdate(). Keyframes up to `newest_keyframe` are the map's own: keyframes
  /// added with such an id were in transit when the map was loaded, and are ignored.
  void restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe);
  void clear();

  PlaneMapperCounters counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
