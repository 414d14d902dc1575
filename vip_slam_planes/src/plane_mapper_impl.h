// SPDX-License-Identifier: BSD-3-Clause
// The plane mapper's state; its steps are spread over plane_mapper_*.cpp.
#pragma once

#include <map>
#include <vector>

#include "growth/growth_pace.h"
#include "state/placed_keyframes.h"
#include "state/plane_changes.h"
#include "vip_slam_planes/association/plane_sampler.h"
#include "vip_slam_planes/association/point_association.h"
#include "vip_slam_planes/detection/strip_evidence.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/merging/gap_view.h"
#include "vip_slam_planes/mesh/depth_mesh.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {

/// Finite, with a unit normal.
bool isSound(const Plane& plane);

class PlaneMapper::Impl {
 public:
  Impl(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera, const DepthNoise& noise,
       TimingLog* timing);

  void addKeyframe(const KeyframePtr& keyframe);
  void grow(const TrackedFrame& frame, const SE3& T_map_odom);
  PlaneUpdate applyMapUpdate(const MapUpdate& update);
  void restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe);
  void clear();

  PlaneMapperOptions options;
  std::shared_ptr<const CameraModel> camera;
  DepthNoise noise;
  TimingLog* timing;
  PlaneMapperCounters counters;
  std::vector<PlaneEstimate> published;

 private:
  using Tracks = std::map<PlaneId, PlaneTrack>;

  // plane_mapper_update.cpp: corrections from the back end.
  void followMode(const MapUpdate& update);
  void removeUnnamed(const MapUpdate& update);
  void takeCorrections(const MapUpdate& update);
  /// False when the keyframe already has this correction.
  bool adoptCameraCorrection(const CameraCorrection& correction, const KeyframePtr& keyframe);
  void removeKeyframe(KeyframeId id);
  void refit(PlaneTrack* track);
  void withdrawBrokenObservations();
  void judgeAgreement();
  bool forgetWhereItWas(PlaneTrack* track);
  void decideOnPoints();

  // plane_mapper_output.cpp: the update to the back end.
  void dropUnsupported(PlaneUpdate* result);
  void publish(PlaneUpdate* result);

  // plane_mapper_keyframe.cpp: one placed keyframe.
  void processKeyframe(const Keyframe& keyframe, bool first_time);
  /// Planes that may be in view of a camera at T_map_C and belong to epochs tied to this one.
  std::vector<PlaneTrack*> tracksInView(const SE3& T_map_C, std::uint32_t epoch);
  void removeContradicted(const std::vector<MapTriangle>& triangles, const SE3& T_map_C, std::uint32_t epoch);
  PlaneTrack& startPlane(PlaneKind kind, const Plane& plane, const Eigen::Vector3d& centroid, std::uint32_t epoch);
  /// Returns the strips found by detection.
  std::vector<DetectedPlane> startPlanes(const Keyframe& keyframe, const SE3& T_map_C,
                                         const std::vector<MapTriangle>& triangles, std::vector<int>* label,
                                         std::vector<PlaneTrack*>* tracks);
  void startJointPlanes(const Keyframe& keyframe, const std::vector<JointPlane>& joint, std::vector<int>* label,
                        std::vector<PlaneTrack*>* tracks);
  void observe(const Keyframe& keyframe, const SE3& T_map_C, const std::vector<PlaneTrack*>& tracks,
               const std::vector<int>& label, const SurfaceLabels& labels, const DepthMesh& mesh, bool first_time);
  /// The plane that shows the same surface as this one, the best if there are several; 0: none.
  PlaneId samePlane(PlaneId id);
  void mergePlanes(const std::vector<PlaneId>& changed);
  void mergeInto(PlaneId from, PlaneId into);
  void removePlane(PlaneId id);
  const Plane* findPlane(PlaneId id) const;

  DepthMeshBuilder mesher_;
  GridRays rays_;
  PlaneSampler sampler_;
  PointAssociation points_;
  PlaneEvidence evidence_;
  StripEvidence strips_;

  PlacedKeyframes keyframes_;
  Tracks tracks_;
  PlaneId next_plane_ = 1;
  OpenGaps open_gaps_;
  GrowthPace pace_;
  PlaneChanges changes_;
  bool came_together_ = false;  ///< epochs were tied, and the planes have not been compared since
  bool localising_ = false;     ///< the back end is in localisation-only mode: its map and planes do not change
};

}  // namespace vip_slam
