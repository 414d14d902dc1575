// SPDX-License-Identifier: BSD-3-Clause
#include "parts/keyframes.h"

#include "vip_slam_frontend/tracking/predicted_motion.h"

namespace vip_slam::frontend {

bool Keyframes::waitsForDepth(bool has_depth, double t) {
  const bool waits = !has_depth && t - last_depth_t_ < kMoment;
  if (has_depth) last_depth_t_ = t;
  return waits;
}

SE3 Keyframes::chainedCamera(const VioFilter& filter, const SE3& T_odom_I, const SE3& T_I_C) const {
  if (last_ == 0) return T_odom_I * T_I_C;
  SE3 moved = T_odom_last_.inverse() * T_odom_I;
  if (const auto T_keyframe_I = filter.poseSinceMark()) {
    moved = *T_keyframe_I * (filter.nav().T_W_I.inverse() * T_odom_I);
  }
  return T_chain_last_ * (T_I_C.inverse() * moved * T_I_C);
}

void Keyframes::accept(Keyframe* keyframe, const std::vector<Feature>& tracked, double t_imu,
                       const InertialInput& inertial, VioFilter* filter) {
  TrackedFrame& frame = keyframe->frame;
  keyframe->id = frame.keyframe = next_++;
  keyframe->previous = last_;
  if (last_ != 0 && !imu_broken_ && inertial.measured(last_imu_t_, t_imu))
    keyframe->imu = inertial.between(last_imu_t_, t_imu);
  if (const RelativeMotion motion = filter->motionSinceMark(); last_ != 0 && motion.isUsable())
    keyframe->motion = motion;
  filter->markNewest();
  T_odom_last_ = frame.state.T_W_I;
  T_chain_last_ = frame.T_chain_C;
  selector_.accept(frame.t, frame.state.T_W_I * frame.T_I_C, tracked);
  last_ = newest_ = keyframe->id;
  last_imu_t_ = t_imu;
  imu_broken_ = false;
}

void Keyframes::reset() {
  selector_.reset();
  last_ = 0;
  imu_broken_ = false;
  last_depth_t_ = -1e300;  // the clock may have run back
}

}  // namespace vip_slam::frontend
