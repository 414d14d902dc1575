// The pose of a camera among points of the map: a RANSAC on pairs of points that uses depth and the known direction of
// gravity, then Gauss-Newton on pixels and depths. World is any frame with z up in which the points are given.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// A point of the map and where the query camera sees it.
struct PlaceMatch {
  Eigen::Vector3d p_W;
  Eigen::Vector2d xy;       ///< normalised coordinates in the query camera
  double depth = 0;         ///< z in the query camera, metres; 0 unknown
  double depth_sigma = 0;   ///< one sigma of it together with the point's own error, metres
  double scale = 1;         ///< pixel noise relative to octave 0
};

struct PlacePoseOptions {
  double focal = 500;        ///< px
  int iterations = 400;
  double ransac_px = 4.0;
  double inlier_px = 3.0;    ///< after refinement
  double depth_sigmas = 4.0; ///< gate on depth
  std::uint64_t seed = 1;
};

struct PlacePose {
  bool found = false;
  SE3 T_W_C;
  std::vector<std::uint32_t> inliers;  ///< ascending
  /// Of the perturbation (theta, t) of T_W_C, with pixel noise of one pixel.
  Matrix6d information = Matrix6d::Zero();
};

/// Whether T_W_C explains a match within the thresholds (px at octave 0; depth by its sigma).
bool explains(const SE3& T_W_C, const PlaceMatch& match, double max_px, const PlacePoseOptions& options);

/// R_G_C: attitude of the query camera in any gravity-aligned frame (its yaw is not used). The best hypothesis with its
/// inliers at ransac_px; not found with fewer than two matches.
PlacePose ransacPlacePose(const std::vector<PlaceMatch>& matches, const Eigen::Quaterniond& R_G_C,
                          const PlacePoseOptions& options);

/// All six degrees of freedom from `start`: robust Gauss-Newton, inliers chosen anew at inlier_px. Not found when fewer
/// than three inliers are left or the pose is not observable.
PlacePose refinePlacePose(const std::vector<PlaceMatch>& matches, const SE3& start, const PlacePoseOptions& options);

}  // namespace vip_slam
