// A feature's sightings as the filter sees them.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/types/feature.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

using BearingJacobian = Eigen::Matrix<double, 2, 4>;

/// Of a bearing of this camera. The correction holds before the lens bends the bearing; undistorted, it is another one
/// at each radius.
BearingJacobian bearingJacobian(const CameraModel& camera, const Eigen::Vector2d& xy);
/// Of a lens that bends nothing.
BearingJacobian bearingJacobian(const Eigen::Vector2d& xy);

struct Observation {
  CloneId clone = 0;
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();  ///< undistorted normalised coordinates
  double depth = 0;                              ///< z, metres; 0: none
  double depth_sigma = 0;                        ///< metres
  /// d z / d xy of the surface there, metres; zero where it is not known. Its depth is read beside it when the depth
  /// image is shifted (WindowState::depth_shift).
  Eigen::Vector2d depth_slope = Eigen::Vector2d::Zero();
  /// What WindowState::bearing does to xy: d xy / d (sx, sy, cx, cy). Zero where the intrinsics are none of the states.
  BearingJacobian by_intrinsics = BearingJacobian::Zero();
  /// L with L^T L the inverse of the pixel's covariance in units of MeasurementNoise::sigma_xy^2.
  Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity();
};

/// z of a sighting, m, as far as it is known what its reading means.
inline double trueDepth(const WindowState& window, const Observation& o) {
  return window.trueDepth(o.depth) + o.depth_slope.dot(window.depth_shift);
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
