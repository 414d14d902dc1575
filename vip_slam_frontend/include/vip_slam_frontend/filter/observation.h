// SPDX-License-Identifier: BSD-3-Clause
// A feature's observations as the filter uses them.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

using BearingJacobian = Eigen::Matrix<double, 2, 4>;

/// Jacobian of an undistorted bearing of this camera by WindowState::bearing. The correction applies to the distorted
/// bearing, so the Jacobian of the undistorted one depends on the radius.
BearingJacobian bearingJacobian(const CameraModel& camera, const Eigen::Vector2d& xy);
/// The same for a lens without distortion.
BearingJacobian bearingJacobian(const Eigen::Vector2d& xy);

/// d xy / d t, 1/s, of a point of a scene at rest, z metres before a camera with these rates of its own, rad/s and m/s,
/// both in its frame.
Eigen::Vector2d bearingRate(const Eigen::Vector2d& xy, double z, const Eigen::Vector3d& omega_C,
                            const Eigen::Vector3d& v_C);

/// Observation::depth_rate where the camera has these rates of its own, rad/s and m/s, both in its frame, and the scene
/// is at rest. `z`: m; `slope`: see Observation.
double depthRate(const Eigen::Vector2d& xy, double z, const Eigen::Vector2d& slope, const Eigen::Vector3d& omega_C,
                 const Eigen::Vector3d& v_C);

struct Observation {
  CloneId clone = 0;
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();  ///< undistorted normalised coordinates
  double depth = 0;                              ///< z, metres; 0: none
  double depth_sigma = 0;                        ///< of the reading's own error, metres
  /// d z / d xy of the surface there, metres; zero where it is not known. When the depth image is shifted
  /// (WindowState::depth_shift) the depth is read next to the pixel, and this slope gives the difference.
  Eigen::Vector2d depth_slope = Eigen::Vector2d::Zero();
  /// d z / d t in this pixel as the camera moves, m/s; zero where the slope is not known.
  double depth_rate = 0;
  /// Jacobian by WindowState::bearing: d xy / d (sx, sy, cx, cy). Zero when the intrinsics are not estimated.
  BearingJacobian by_intrinsics = BearingJacobian::Zero();
  /// d xy / d WindowState::readout, 1/s: how xy, which is as seen at the stamp, depends on when the row was read.
  Eigen::Vector2d by_readout = Eigen::Vector2d::Zero();
  /// L with L^T L the inverse of the pixel's covariance in units of MeasurementNoise::sigma_xy^2.
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();
  /// One sigma of the error of depth that is shared with readings nearby, in this image and in others, metres.
  double depth_shared = 0;
};

/// Bearing of an observation at the stamp: as measured, corrected by the estimated intrinsics and readout.
inline Eigen::Vector2d trueBearing(const WindowState& window, const Observation& o) {
  return o.xy + o.by_intrinsics * window.bearing.value + o.by_readout * window.readout;
}

/// Depth z of an observation, m: its reading corrected by the estimated scale, offset, shift and delay.
inline double trueDepth(const WindowState& window, const Observation& o) {
  return window.trueDepth(o.depth) + o.depth_slope.dot(window.depth_shift) + o.depth_rate * window.depth_delay;
}

struct FilterTrack {
  LandmarkId id = kNoLandmark;
  std::vector<Observation> observations;  ///< one per clone, oldest first
};

/// Noise of one image: sigma_xy = sigma_px / focal.
struct MeasurementNoise {
  double sigma_xy = 0.001;
  double depth_inflation = 1.0;
  bool use_depth = true;
};

}  // namespace vip_slam
