// The plane module (paper section "Plane Detection and Association"). ROS-free; one owner thread.
//
// Keyframes go in with addKeyframe() and wait until a MapUpdate places them in `map`; tracked frames only grow planes
// that exist. Everything that comes out is in `map`. Normals point to the side a plane was seen from, so that the two
// faces of a door are two planes. Epochs of the odometry that no accepted loop of a MapUpdate has tied yet keep planes
// of their own.
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
  std::uint64_t keyframes_forgotten = 0;  ///< never placed by the back end, dropped
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

  /// Remembered until a MapUpdate has placed it. A null keyframe, a known id, or a depth grid whose size is not what it
  /// says is ignored.
  void addKeyframe(KeyframePtr keyframe);
  /// Image rate: extends planes that exist; starts none. Does nothing without depth, while not tracking, or when the
  /// frame belongs to another epoch than the newest keyframe.
  void grow(const TrackedFrame& frame, const SE3& T_map_odom);
  /// Takes the corrections, then detects, associates and merges with the keyframes that are now placed. Poses, planes
  /// and landmarks that are not finite are passed over. A wall whose observations have come to disagree is reported as
  /// removed, and may come back by its id. From an update that gives back a waiting keyframe, as one of a back end that
  /// only localises does, until one that places a keyframe or moves everything, planes stay as they are.
  PlaneUpdate applyMapUpdate(const MapUpdate& update);
  /// Confirmed planes, by id; polygons are as of the last applyMapUpdate().
  const std::vector<PlaneEstimate>& planes() const;
  /// Starts from the planes of a loaded map; everything known before is forgotten. Planes without area, or not finite,
  /// are reported as removed by the next applyMapUpdate(). Keyframes up to `newest_keyframe` are the map's own: what
  /// comes under such a number was on its way when it was loaded, and is left out.
  void restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe);
  void clear();

  const PlaneMapperCounters& counters() const;
  const PlaneMapperOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vip_slam
