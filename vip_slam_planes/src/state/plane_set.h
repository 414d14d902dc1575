// SPDX-License-Identifier: BSD-3-Clause
// The planes of the map, published or not. No id is used twice, and whatever becomes of a published plane or of its
// observations is told to the back end once, by the next tell(). The caller tells the points (PointAssociation) which
// planes were merged and removed.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "placed_keyframes.h"
#include "plane_changes.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam::planes {

/// Finite, with a unit normal.
bool isSound(const Plane& plane);

class PlaneSet {
 public:
  using Tracks = std::map<PlaneId, PlaneTrack>;
  /// Counted since construction.
  struct Counts {
    std::uint64_t started = 0, merged = 0, removed = 0;  ///< removed: published ones
  };

  explicit PlaneSet(const PlaneMapperOptions& options)
      : growth_(options.growth), merging_(options.merging), support_(options.support) {}

  // By id. Planes are changed in place; they come and go by the functions below only.
  Tracks::iterator begin() { return tracks_.begin(); }
  Tracks::iterator end() { return tracks_.end(); }
  bool empty() const { return tracks_.empty(); }
  PlaneTrack& at(PlaneId id) { return tracks_.at(id); }
  /// Null without such a plane.
  PlaneTrack* find(PlaneId id);
  /// Those that may be in view of a camera at T_map_C, or grow into view, and belong to epochs tied to this one.
  /// `range` of depth, metres.
  std::vector<PlaneTrack*> inView(const SE3& T_map_C, std::uint32_t epoch, double range,
                                  const PlacedKeyframes& keyframes);

  PlaneTrack& start(PlaneKind kind, const Plane& plane, const Eigen::Vector3d& centroid, std::uint32_t epoch);
  /// Takes over a published plane of a loaded map. False when it has no area or is not finite: then the back end is
  /// told that it is removed.
  bool restore(const StoredPlane& stored);
  void remove(PlaneId id);
  /// Removes planes that have lost their area, and those that keyframes looked at without confirming them; their ids.
  std::vector<PlaneId> dropUnsupported();

  /// The next mergeSame() compares all planes.
  void compareAll() { compare_all_ = true; }
  /// Merges planes that show the same surface, if one of them has changed since the last call. Returns the merges in
  /// their order.
  std::vector<PlaneMerge> mergeSame(const PlacedKeyframes& keyframes, const CameraModel& camera);

  /// Adds an observation, or replaces that of the same keyframe.
  void observe(PlaneTrack* track, PlaneObservation observation);
  /// Removes an observation that became invalid; the plane is due for a fit.
  void withdraw(PlaneTrack* track, KeyframeId keyframe);
  /// A plane that is not to be published any more is kept here only.
  void unpublish(PlaneTrack* track);
  /// A plane that is published again: the back end has none of its observations.
  void republish(const PlaneTrack& track);
  /// A keyframe is removed, and the back end knows. `heir`: the keyframe that its cells move with, 0: none.
  void forgetKeyframe(KeyframeId id, KeyframeId heir, const CameraPoses& poses);

  /// All planes to publish, and the changes since the last call.
  void tell(PlaneUpdate* update);
  /// As told last or loaded.
  const std::vector<PlaneEstimate>& published() const { return published_; }

  const Counts& counts() const { return counts_; }
  /// Forgets all planes. Nothing is told of them.
  void clear();

 private:
  /// The plane that shows the same surface as this one, the best if there are several; 0: none.
  PlaneId samePlane(PlaneId id, const PlacedKeyframes& keyframes, const SceneView& view) const;
  void merge(const PlaneMerge& merge, const PlacedKeyframes& keyframes);

  PlaneGrowthOptions growth_;
  PlaneMergingOptions merging_;
  PlaneSupportOptions support_;
  Tracks tracks_;
  PlaneId next_ = 1;
  OpenGaps open_gaps_;
  bool compare_all_ = false;
  PlaneChanges changes_;
  std::vector<PlaneEstimate> published_;
  Counts counts_;
};

}  // namespace vip_slam::planes
