// SPDX-License-Identifier: BSD-3-Clause
// Where the odometry lies in the map: T_map_odom of its present epoch, a guess until the map holds it.
#pragma once

#include <cstdint>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/types/keyframe.h"

namespace vip_slam::backend {

class OdometryInMap {
 public:
  const SE3& T_map_odom() const { return T_map_odom_; }
  std::uint32_t epoch() const { return epoch_; }

  /// The state of a keyframe in the map. Where the odometry restarted it goes on, levelled, at the end of the map,
  /// until a loop or a relocalisation gives its true place.
  NavState predict(const Keyframe& keyframe, const Map& map);
  /// Takes the place of the newest keyframe, when it is of the present epoch.
  void follow(const Map& map);
  /// The odometry of this image is at T_map_I; levelled, since gravity is known in both.
  void place(const TrackedFrame& frame, const SE3& T_map_I);
  /// The map around it moved by `move`.
  void move(const SE3& move) { T_map_odom_ = move * T_map_odom_; }
  /// A stored map was loaded: its newest epoch is the present one until the odometry is found.
  void startIn(const Map& map);

 private:
  SE3 T_map_odom_;
  std::uint32_t epoch_ = 0;
};

}  // namespace vip_slam::backend
