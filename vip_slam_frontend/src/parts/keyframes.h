// SPDX-License-Identifier: BSD-3-Clause
// The keyframes so far: when the next one is due, its number, and what ties it to the one before.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/keyframes/keyframe_selector.h"

namespace vip_slam::frontend {

class Keyframes {
 public:
  Keyframes(const KeyframeOptions& options, KeyframeId first) : selector_(options), next_(first) {}

  KeyframeId newest() const { return newest_; }  ///< of all epochs; 0: none yet
  /// A loaded map has keyframes of its own: new numbers continue after them.
  void continueAfter(KeyframeId id) { next_ = std::max(next_, id + 1); }
  /// An IMU gap, or a gyro at the limit of its range: the next keyframe gets no IMU factor.
  void noteBrokenImu() { imu_broken_ = true; }
  /// One image. Whether a keyframe should wait for the next one with depth, when the depth camera is the slower one:
  /// without depth it has no planes.
  bool waitsForDepth(bool has_depth, double t);
  const KeyframeSelector& selector() const { return selector_; }

  /// TrackedFrame::T_chain_C for the body pose T_odom_I, at the filter's newest image or a little later.
  SE3 chainedCamera(const VioFilter& filter, const SE3& T_odom_I, const SE3& T_I_C) const;
  /// Fills number, IMU and motion of a keyframe at t_imu (IMU clock, s), which is the newest one from here on.
  /// `tracked`: its tracked features.
  void accept(Keyframe* keyframe, const std::vector<Feature>& tracked, double t_imu, const InertialInput& inertial,
              VioFilter* filter);
  /// Time from which on the next keyframe needs the IMU; `otherwise` when there is none.
  double imuSince(double otherwise) const { return last_ != 0 ? std::min(last_imu_t_, otherwise) : otherwise; }
  /// A new epoch; numbers go on.
  void reset();

 private:
  KeyframeSelector selector_;
  KeyframeId next_, newest_ = 0;
  KeyframeId last_ = 0;             ///< of this epoch
  SE3 T_odom_last_, T_chain_last_;  ///< its body pose, and its camera pose
  double last_imu_t_ = 0;
  bool imu_broken_ = false;       ///< IMU gap or gyro saturation since the last keyframe
  double last_depth_t_ = -1e300;  ///< last image with a depth image
};

}  // namespace vip_slam::frontend
