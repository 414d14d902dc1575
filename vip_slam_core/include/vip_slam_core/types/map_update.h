// SPDX-License-Identifier: BSD-3-Clause
// The back end's output to front end and planes after each optimisation. World is `map`.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct KeyframeEstimate {
  KeyframeId id = 0;
  NavState state;                      ///< T_map_I, v_map, biases
  SE3 T_I_C;                           ///< present camera-IMU extrinsics; the keyframe itself has those of its creation
  CameraCorrection camera_correction;  ///< present correction of its depth readings and bearings, likewise
};

struct LandmarkEstimate {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  std::uint32_t observations = 0;
  PlaneId plane = 0;  ///< 0: on none
  Descriptor descriptor{};
};

struct LoopEvent {
  KeyframeId query = 0, match = 0;
  bool accepted = false;
  std::string reason;  ///< why it was rejected, or the evidence for it
  int inliers = 0;
  SE3 T_match_query;  ///< IMU frames
  double t = 0;
};

/// Epochs of the odometry with the same `part` have a known relative pose. The relative pose of parts is a guess until
/// a loop or relocalisation ties them.
struct EpochPart {
  std::uint32_t epoch = 0;
  std::uint32_t part = 0;  ///< named by one of its epochs
};

struct MapUpdate {
  std::uint64_t revision = 0;  ///< increases by one per update
  double t = 0;                ///< stamp of the newest keyframe in it
  std::uint32_t epoch = 0;     ///< epoch that T_map_odom belongs to
  SE3 T_map_odom;
  bool placed = true;  ///< false: T_map_odom is a guess until a loop or relocalisation ties that epoch to the map
  std::vector<EpochPart> parts;  ///< all epochs of the map, in every update
  KeyframeId newest_keyframe = 0;
  DepthCurve depth_curve;                         ///< depth correction estimated from the map
  double disparity_error = 0;                     ///< 1/m, the part of depth_curve due to it; see disparity_curve.h
  double odometry_variance = 1;                   ///< factor on the odometry's covariance, by the map
  bool global = false;                            ///< everything moved (GBA, loop); else a local window
  std::vector<KeyframeEstimate> keyframes;        ///< changed ones (all when global)
  std::vector<LandmarkEstimate> landmarks;        ///< changed ones (all when global)
  std::vector<std::pair<PlaneId, Plane>> planes;  ///< optimised planes
  std::vector<KeyframeId> removed_keyframes;
  std::vector<LandmarkId> removed_landmarks;
  std::vector<std::pair<LandmarkId, LandmarkId>> merged_landmarks;  ///< (from, into)
  std::vector<LoopEvent> loops;                                     ///< since the previous update
};

}  // namespace vip_slam
