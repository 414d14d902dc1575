// SPDX-License-Identifier: BSD-3-Clause
// The plane mapper's parts, and the order of their steps: what images add in plane_mapper_images.cpp, what the back end
// changes in plane_mapper_update.cpp.
#pragma once

#include <vector>

#include "association/plane_observer.h"
#include "growth/growth_pace.h"
#include "state/back_end_mode.h"
#include "state/placed_keyframes.h"
#include "state/plane_set.h"
#include "vip_slam_planes/association/point_association.h"
#include "vip_slam_planes/detection/plane_evidence.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/mesh/depth_mesh.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {

class PlaneMapper::Impl {
 public:
  Impl(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera, const DepthNoise& noise,
       TimingLog* timing);

  void addKeyframe(const KeyframePtr& keyframe);
  void grow(const TrackedFrame& frame, const SE3& T_map_odom);
  PlaneUpdate applyMapUpdate(const MapUpdate& update);
  void restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe);
  void clear();

  const std::vector<PlaneEstimate>& published() const { return planes_.published(); }
  PlaneMapperCounters counters() const;

 private:
  // plane_mapper_update.cpp: corrections from the back end.
  void removeUnnamed(const MapUpdate& update);
  void takeCorrections(const MapUpdate& update);
  /// False when the keyframe already has this correction.
  bool adoptCameraCorrection(const CameraCorrection& correction, const KeyframePtr& keyframe);
  void removeKeyframe(KeyframeId id);
  void withdrawBrokenObservations();
  void judgeAgreement();
  bool forgetWhereItWas(PlaneTrack* track);
  void decideOnPoints();
  /// The update to the back end.
  void tell(PlaneUpdate* result);

  // plane_mapper_images.cpp: one placed keyframe.
  void processKeyframe(const Keyframe& keyframe, bool first_time);
  std::vector<PlaneTrack*> tracksInView(const SE3& T_map_C, std::uint32_t epoch);
  void removeContradicted(const std::vector<MapTriangle>& triangles, const SE3& T_map_C, std::uint32_t epoch);
  void startPlanes(const Keyframe& keyframe, const SE3& T_map_C, const std::vector<MapTriangle>& triangles,
                   std::vector<int>* label, std::vector<PlaneTrack*>* tracks);
  void startJointPlanes(const Keyframe& keyframe, const std::vector<JointPlane>& joint, std::vector<int>* label,
                        std::vector<PlaneTrack*>* tracks);
  void observe(const Keyframe& keyframe, const SE3& T_map_C, const std::vector<PlaneTrack*>& tracks,
               const std::vector<int>& label, const SurfaceLabels& labels, const DepthMesh& mesh, bool first_time);
  /// Null without such a plane.
  const Plane* findPlane(PlaneId id);

  const PlaneMapperOptions options_;
  const std::shared_ptr<const CameraModel> camera_;
  const DepthNoise noise_;
  TimingLog* const timing_;

  DepthMeshBuilder mesher_;
  planes::PlaneObserver observer_;
  PlaneEvidence evidence_;
  PlacedKeyframes keyframes_;
  planes::PlaneSet planes_;
  PointAssociation points_;
  GrowthPace pace_;
  planes::BackEndMode mode_;
  PlaneMapperCounters counters_;  ///< without those that the parts count
};

}  // namespace vip_slam
