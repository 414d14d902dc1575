// What the front end hands on: a tracked frame per image and a keyframe now and then. Immutable once published.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_image.h"
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
  /// The camera, put together of its motions since one keyframe after the other, each as the filter knew it at the
  /// later image. The way from one image to the next in `state` has in it what the filter has corrected of both
  /// meanwhile (the direction of gravity, by tenths of a degree when the body begins to move); this has not. Its origin
  /// is the odometry's, but it drifts freely: only ways between neighbours mean something.
  SE3 T_chain_C;
  double time_offset = 0;              ///< t_imu = t_image + time_offset
  CameraCorrection camera_correction;  ///< what features and grid have been added to the camera's readings
  std::vector<Feature> features;       ///< tracked features only
  DepthGrid depth_grid;                ///< coarse, for plane growth; empty without depth
  bool zero_velocity = false;          ///< standing still
  KeyframeId keyframe = 0;             ///< newest keyframe at or before this image
};

struct Keyframe {
  KeyframeId id = 0;        ///< 1, 2, 3, ...
  TrackedFrame frame;       ///< features include untracked ORB corners (id == kNoLandmark) for matching
  KeyframeId previous = 0;  ///< 0: first of its epoch
  /// Samples from the previous keyframe's IMU time to this one's, both ends interpolated; empty when previous == 0
  /// or when a gap made them useless.
  std::vector<ImuSample> imu;
  /// What the front end found out by now about the rates in `imu`, which do not have it: see gyro_correction.h.
  Eigen::Matrix3d gyro_correction = Eigen::Matrix3d::Zero();
  double imu_noise_scale = 1;  ///< how many times as noisy as configured the front end has found the IMU
  /// The odometry's motion since the previous keyframe; unknown when previous == 0 or when it lost the thread. Not the
  /// difference of the two published states: those were corrected in between.
  RelativeMotion motion;
};

/// Keyframes that wait while a loaded map is not recognised yet, about ten minutes of them: the back end and the plane
/// module keep the same ones, so that all that enter the map late have their planes.
constexpr std::size_t kMostWaitingKeyframes = 1500;

using KeyframePtr = std::shared_ptr<const Keyframe>;
using TrackedFramePtr = std::shared_ptr<const TrackedFrame>;

}  // namespace vip_slam
