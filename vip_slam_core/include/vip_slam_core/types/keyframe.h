// SPDX-License-Identifier: BSD-3-Clause
// Output of the front end: a tracked frame per image, and keyframes. Immutable once published.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/relative_motion.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_core/types/tracking_state.h"

namespace vip_slam {

/// One image's result; poses in `odom`.
struct TrackedFrame {
  double t = 0;             ///< image stamp, seconds
  std::uint32_t epoch = 0;  ///< counts restarts of the odometry; poses of different epochs share no frame
  TrackingStatus status;
  NavState state;                            ///< T_odom_I, v, biases
  Matrix15d covariance = Matrix15d::Zero();  ///< of state, order (theta, p, v, b_g, b_a)
  SE3 T_I_C;                                 ///< extrinsics in use (online-calibrated)
  /// The camera's pose chained from its motions since successive keyframes, each as estimated at the later image.
  /// Differences of `state` between images also contain the filter's corrections of both in the meantime (of the
  /// gravity direction by tenths of a degree when the body begins to move); differences of this pose do not. Its origin
  /// is that of odom, but it drifts freely: only motions between neighbouring images are meaningful.
  SE3 T_chain_C;
  double time_offset = 0;              ///< t_imu = t_image + time_offset
  CameraCorrection camera_correction;  ///< applied to the depth and bearings of features and grid
  std::vector<Feature> features;       ///< tracked features only
  DepthGrid depth_grid;                ///< coarse, for plane growth; empty without depth
  bool zero_velocity = false;          ///< standing still
  KeyframeId keyframe = 0;             ///< newest keyframe at or before this image
};

/// Covariance of (x y z, rotation), both in odom, as in messages and evaluation. The state's covariance has the
/// rotation in the body frame and the order (rotation, position).
inline Matrix6d poseCovariance(const TrackedFrame& frame) {
  Matrix6d J = Matrix6d::Zero();
  J.topRightCorner<3, 3>().setIdentity();
  J.bottomLeftCorner<3, 3>() = frame.state.T_W_I.R();
  return J * frame.covariance.topLeftCorner<6, 6>() * J.transpose();
}

struct Keyframe {
  KeyframeId id = 0;        ///< 1, 2, 3, ...
  TrackedFrame frame;       ///< features include untracked ORB corners (id == kNoLandmark) for matching
  KeyframeId previous = 0;  ///< 0: first of its epoch
  /// Samples from the previous keyframe's IMU time to this one's, both ends interpolated; empty when previous == 0
  /// or when a gap made them useless.
  std::vector<ImuSample> imu;
  /// Present estimate of the gyro's correction, which is not applied to the rates in `imu`: see gyro_correction.h.
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();
  ImuNoiseScale imu_noise_scale;  ///< estimated by the front end
  DepthNoiseParts depth_noise;    ///< of the recording, learnt by the front end up to here
  /// The odometry's motion since the previous keyframe; unknown when previous == 0 or when tracking was interrupted.
  /// Not the difference of the two published states, which were corrected in between.
  RelativeMotion motion;
};

/// Largest number of keyframes that wait while a loaded map is not recognised yet, about ten minutes: back end and
/// plane module use the same limit, so that all keyframes that enter the map late have their planes.
constexpr std::size_t kMaxWaitingKeyframes = 1500;

using KeyframePtr = std::shared_ptr<const Keyframe>;
using TrackedFramePtr = std::shared_ptr<const TrackedFrame>;

}  // namespace vip_slam
