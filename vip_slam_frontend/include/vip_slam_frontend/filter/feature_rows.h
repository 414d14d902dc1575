// Measurement rows of one feature (MSCKF): per view two pixel rows and, when there is a depth, one depth row
// lambda - z_C; whitened; the feature itself is projected out by a QR of its Jacobian, which leaves
// 2 m + n_depth - 3 rows.
#pragma once

#include <Eigen/Core>

#include "vip_slam_frontend/filter/observation.h"

namespace vip_slam {

struct FeatureRows {
  Eigen::MatrixXd H;  ///< rows x window.dimension()
  Eigen::VectorXd r;
};

/// Before the projection: H_x, H_f and r, whitened. Residuals at the present estimate, Jacobians at the first estimates
/// of the poses (FEJ) and at f_W. Views whose clone left the window, or with f behind the camera, are skipped.
void stackFeature(const WindowState& window, const std::vector<Observation>& observations, const Eigen::Vector3d& f_W,
                  const MeasurementNoise& noise, Eigen::MatrixXd* H_x, Eigen::MatrixXd* H_f, Eigen::VectorXd* r);

/// The rows left after projecting the feature out; empty when there are three or fewer.
FeatureRows featureRows(const WindowState& window, const std::vector<Observation>& observations,
                        const Eigen::Vector3d& f_W, const MeasurementNoise& noise);

}  // namespace vip_slam
