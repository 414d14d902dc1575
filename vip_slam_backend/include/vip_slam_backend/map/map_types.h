// SPDX-License-Identifier: BSD-3-Clause
// What the map holds: keyframes with their states, landmarks (points) and planes. World is `map`, z up.
#pragma once

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// Thrown when the map refuses an input; the map is unchanged. what() names the input and the reason.
class MapError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct MapObservation {
  KeyframeId keyframe = 0;
  std::uint32_t feature = 0;  ///< index into the keyframe's features
  bool operator==(const MapObservation& o) const { return keyframe == o.keyframe && feature == o.feature; }
};

struct MapKeyframe {
  KeyframePtr data;     ///< as published by the front end, with the present corrections of depth and bearings
  NavState state;       ///< estimate in `map`: T_map_I, v, biases
  SE3 T_I_C;            ///< present camera-IMU extrinsics
  bool stored = false;  ///< from a stored map: the present camera's calibration does not apply to it
  /// Landmark of each feature, kNoLandmark when none; same length as data->frame.features.
  std::vector<LandmarkId> landmarks;
  /// Neighbours on the chain of one odometry (0: none). They skip keyframes that were culled.
  KeyframeId previous = 0, next = 0;
  /// Measured samples, and IMU factor, from `previous`; null when there is none, since the
  /// sensor has no IMU or a gap made it useless.
  std::shared_ptr<const std::vector<ImuSample>> imu;
  std::shared_ptr<const Preintegration> preintegration;
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();  ///< applied in the factor, see Keyframe
  ImuNoiseScale imu_noise_scale;                              ///< likewise
  /// The odometry's motion from `previous`; unknown when there is none.
  RelativeMotion motion;
  /// Depth points of this keyframe on planes.
  std::map<PlaneId, PlaneObservation> planes;
  bool loop_keyframe = false;  ///< end of an accepted loop: culled in a crowd only, see culling.h

  KeyframeId id() const { return data->id; }
  const std::vector<Feature>& features() const { return data->frame.features; }
  SE3 T_W_C() const { return state.T_W_I * T_I_C; }
};

struct MapLandmark {
  LandmarkId id = kNoLandmark;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Descriptor descriptor{};                   ///< medoid of its newest observations' descriptors
  std::vector<MapObservation> observations;  ///< ascending keyframe id, one per keyframe; never empty
  PlaneId plane = 0;                         ///< 0: on none
  std::uint32_t visible = 0, found = 0;      ///< times predicted into a keyframe, and times matched there

  KeyframeId host() const { return observations.front().keyframe; }
};

struct MapPlane {
  PlaneEstimate estimate;
  bool optimised = false;       ///< has been a variable of a bundle adjustment
  double surface_variance = 0;  ///< by which its points lie beside it, m^2; 0: not measured
};

}  // namespace vip_slam
