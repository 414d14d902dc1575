// SPDX-License-Identifier: BSD-3-Clause
// Measurement rows of one feature (MSCKF): per view two pixel rows and, when there is a depth, one depth row
// lambda - z_C; whitened; the feature itself is projected out by a QR of its Jacobian, which leaves
// 2 m + n_depth - 3 rows. The QR goes view by view, so that a row has zeros for all clones before its view: later steps
// cost a third of what full rows would.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_frontend/filter/observation.h"

namespace vip_slam {

struct FeatureRows {
  Eigen::MatrixXd H;  ///< rows x window.dimension(), those of the oldest views first
  Eigen::VectorXd r;
};

/// Where a view's rows begin, and its clone's column.
struct ViewRows {
  int begin = 0, column = 0;
};

/// Before the projection: H_x, H_f and r, whitened. Residuals at the present estimate, Jacobians at the first estimates
/// of the poses (FEJ) and at f_W. Views whose clone left the window, or with f behind the camera, are skipped.
std::vector<ViewRows> stackFeature(const WindowState& window, const std::vector<Observation>& observations,
                                   const Eigen::Vector3d& f_W, const MeasurementNoise& noise, Eigen::MatrixXd* H_x,
                                   Eigen::MatrixXd* H_f, Eigen::VectorXd* r);

/// The rows left after projecting the feature out; empty when there are three or fewer.
FeatureRows featureRows(const WindowState& window, const std::vector<Observation>& observations,
                        const Eigen::Vector3d& f_W, const MeasurementNoise& noise);

}  // namespace vip_slam
