// SPDX-License-Identifier: BSD-3-Clause
// The pose of a camera, or of a rig of cameras, from matched points of the map: a RANSAC on pairs of points that uses
// depth and the known direction of gravity, then Gauss-Newton on pixels and depths. World is any frame with z up in
// which the points are given. Several keyframes of one odometry form a rig: over a second or two its drift is far below
// a pixel.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// T_B_C of each camera in the body B of the rig. A single camera is its own body.
using CameraRig = std::vector<SE3>;
CameraRig singleCamera();

/// A point of the map and where a camera of the rig sees it.
struct PlaceMatch {
  std::uint32_t camera = 0;
  Eigen::Vector3d p_W;
  Eigen::Vector2d xy;      ///< normalised coordinates in that camera
  double depth = 0;        ///< z in that camera, metres; 0 unknown
  double depth_sigma = 0;  ///< one sigma of it together with the point's own error, metres
  double scale = 1;        ///< pixel noise relative to octave 0
};

/// A point of a depth image and the plane of the map it lies on.
struct PlaceSurface {
  std::uint32_t camera = 0;
  Eigen::Vector3d p_C;
  Plane plane_W;
  double sigma = 0.02;  ///< of the distance, metres
};

struct PlacePoseOptions {
  double focal = 500;  ///< px
  int iterations = 400;
  double ransac_px = 4.0;
  double inlier_px = 3.0;     ///< after refinement
  double depth_sigmas = 4.0;  ///< gate on depth
  double depth_shared = 0;    ///< error that depths of one surface have in common, as a share of their sigma
  double tilt_sigma = 0;      ///< of the refined attitude's tilt against the given one, radians; 0: tilt is free
  std::uint64_t seed = 1;
};

struct PlacePose {
  bool found = false;
  SE3 T_W_B;
  std::vector<std::uint32_t> inliers;  ///< ascending
  /// Information of the perturbation (theta, t) of T_W_B, with pixel noise of one pixel; depths that share their error
  /// are not worth their number.
  Matrix6d information = Matrix6d::Zero();
};

/// Whether T_W_C explains a match within the thresholds (px at octave 0; depth by its sigma).
bool explains(const SE3& T_W_C, const PlaceMatch& match, double max_px, const PlacePoseOptions& options);

/// R_G_B: attitude of the body in any gravity-aligned frame (its yaw is not used). The best hypothesis with its
/// inliers at ransac_px; not found with fewer than two matches.
PlacePose ransacPlacePose(const std::vector<PlaceMatch>& matches, const CameraRig& rig, const Eigen::Quaterniond& R_G_B,
                          const PlacePoseOptions& options);

/// All six degrees of freedom from `start` (T_W_B): robust Gauss-Newton, inliers reselected at inlier_px. The tilt of
/// R_G_B is a further measurement when options.tilt_sigma is set, and so are the surfaces. Not found when fewer than
/// three inliers are left or the pose is not observable.
PlacePose refinePlacePose(const std::vector<PlaceMatch>& matches, const CameraRig& rig, const SE3& start,
                          const Eigen::Quaterniond& R_G_B, const PlacePoseOptions& options,
                          const std::vector<PlaceSurface>& surfaces = {});

}  // namespace vip_slam
