// SPDX-License-Identifier: BSD-3-Clause
#include "odometry_in_map.h"

namespace vip_slam::backend {

NavState OdometryInMap::predict(const Keyframe& keyframe, const Map& map) {
  const NavState& odom = keyframe.frame.state;
  if (!map.empty() && keyframe.frame.epoch != epoch_)
    T_map_odom_ = alignLevelled(map.keyframe(map.newestKeyframe()).state.T_W_I, odom.T_W_I);
  epoch_ = keyframe.frame.epoch;
  NavState state = odom;
  state.T_W_I = T_map_odom_ * odom.T_W_I;
  state.v_W = T_map_odom_.rotation() * odom.v_W;
  // A stored map may have another keyframe with that id, with another IMU's biases.
  if (keyframe.previous != 0 && map.hasKeyframe(keyframe.previous) &&
      map.keyframe(keyframe.previous).data->frame.epoch == epoch_) {
    const NavState& previous = map.keyframe(keyframe.previous).state;
    state.bias_gyro = previous.bias_gyro;
    state.bias_accel = previous.bias_accel;
  }
  return state;
}

void OdometryInMap::follow(const Map& map) {
  const MapKeyframe& newest = map.keyframe(map.newestKeyframe());
  if (newest.data->frame.epoch == epoch_) T_map_odom_ = newest.state.T_W_I * newest.data->frame.state.T_W_I.inverse();
}

void OdometryInMap::place(const TrackedFrame& frame, const SE3& T_map_I) {
  epoch_ = frame.epoch;
  T_map_odom_ = alignLevelled(T_map_I, frame.state.T_W_I);
}

void OdometryInMap::startIn(const Map& map) { epoch_ = map.keyframe(map.newestKeyframe()).data->frame.epoch; }

}  // namespace vip_slam::backend
