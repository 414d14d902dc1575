// SPDX-License-Identifier: BSD-3-Clause
// Rows from depth alone: points of the newest depth image lie on the flat patches that an earlier one saw. They need no
// corners, so they constrain five degrees of freedom in a corridor with textureless walls. Per pair, in the patch's
// camera:
//   n^T (T_ref_cur q - p) = 0.
// The rows depend on the relative pose of two clones and on the camera's calibration only: position and yaw of the
// window stay unobservable.
//
// Their noise has two parts: white, of each pair, and one that the pairs of a surface share the more the nearer they
// are in the image: its correlation falls to 1 / e over a tenth of bearing. A surface's rows are multiplied by the
// inverse Cholesky factor of their covariance, so that a small surface is worth no more than its shared part, however
// many pairs it has, and a large one as much as the independent errors on it allow.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

/// A point on a patch and one that should lie on it, both from raw depth readings: the depth offset is a state.
struct SurfacePair {
  Eigen::Vector3d p_ref = Eigen::Vector3d::Zero();  ///< on the patch, camera frame of the reference, metres
  Eigen::Vector3d n_ref = Eigen::Vector3d::Zero();  ///< unit normal, same frame
  Eigen::Vector3d q_cur = Eigen::Vector3d::Zero();  ///< in the newest camera, metres
  double sigma = 0.01;                              ///< one sigma of the distance along the normal, metres: white part
  double shared = 0;                                ///< likewise, of the part that pairs near each other share
  int surface = 0;                                  ///< pairs of different numbers share nothing
};

struct SurfaceMatches {
  CloneId reference = 0;
  std::vector<SurfacePair> pairs;
};

struct SurfaceRows {
  FeatureRows rows;  ///< whitened and compressed to the dimension of relative pose and calibration; empty when too few
                     ///< pairs are left
  int used = 0, gated = 0;
};

/// Rows between the reference's clone and the newest one. `R` is the filter's factor: pairs with residuals beyond four
/// sigmas of state and noise are gated (another surface), the rest is Huber-weighted at `huber`. Residuals at the
/// present estimate, Jacobians at the first estimates.
SurfaceRows surfaceRows(const WindowState& window, const Eigen::MatrixXd& R, const SurfaceMatches& matches,
                        double huber);

}  // namespace vip_slam
