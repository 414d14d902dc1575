// SPDX-License-Identifier: BSD-3-Clause
// The part of the depth noise that neighbouring readings share (tracking/surface_noise.h), for single points. A reading
// has an error of its own, and one in common with what lies near it in the image, and with the same place in the images
// before and after: a random field over the image that stays while the camera moves on.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam::frontend {

/// A row of a system for a depth, in sigmas of the reading's own error.
struct DepthRow {
  int row = 0;
  double shared = 0;                             ///< one sigma of the shared error, in sigmas of the reading's own
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();  ///< the place in the image, normalised
};

/// Makes the errors of the depth rows of one track independent and of unit variance: multiplies them by the inverse of
/// U, where U U^T is their covariance. `depths` in the order of the rows. U is upper triangular, so that a row keeps
/// its zeros before the first column that it or a later one has.
void decorrelateDepth(const std::vector<DepthRow>& depths, Eigen::MatrixXd* H_x, Eigen::MatrixXd* H_f,
                      Eigen::VectorXd* r);

}  // namespace vip_slam::frontend
