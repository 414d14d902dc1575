// SPDX-License-Identifier: BSD-3-Clause
// A feature's position from its observations in the window: start from the median of the depth readings (robust against
// readings across an edge) or, without depth, from the least squares of all rays; then Gauss-Newton over pixels and
// depths in the inverse-depth form (x/z, y/z, 1/z) of the first camera.
#pragma once

#include <Eigen/Core>

#include "vip_slam_frontend/filter/observation.h"

namespace vip_slam {

struct Triangulation {
  bool ok = false;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  int depth_rows = 0;              ///< depth readings that took part
  double sigma_inverse_depth = 0;  ///< one-sigma of 1/z in the first camera, from the normal matrix
  double inverse_depth = 0;
  double pixel_chi2 = 0;  ///< sum of squared whitened pixel residuals after the fit
  double depth_chi2 = 0;  ///< squared depth residuals, whitened
  int pixel_rows = 0;
};

Triangulation triangulate(const WindowState& window, const std::vector<Observation>& observations,
                          const MeasurementNoise& noise);

/// Camera pose T_W_C of a clone at the present estimate, moved along by the change of the delay.
SE3 cameraPose(const WindowState& window, const Clone& clone);

}  // namespace vip_slam
