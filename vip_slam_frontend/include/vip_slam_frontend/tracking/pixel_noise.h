// How well a patch fixes its pixel. Grey levels scatter alike in every direction, the pixel does not: along a straight
// edge hardly anything changes when the patch is moved, and a faint corner moves further than a strong one under the
// same noise. The covariance of a least-squares match is sigma_grey^2 G^-1 with G the sum of the gradients' products.
#pragma once

#include <Eigen/Core>

#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

/// Lower triangular L with L^T L the inverse of the pixel's covariance in units of the best patches' variance:
/// residuals in pixels times L / sigma_px are white. `texture`: sum of gradient products, (grey levels / px)^2;
/// `residual`: of the match, grey levels; `at_edge`: the patch shows two surfaces, or one that the depth does not
/// explain, so that what it shows changes with the view.
Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, bool at_edge);

/// Geometric mean of the two standard deviations, same unit.
double pixelSigma(const Eigen::Matrix2d& whitening);

/// One sigma, px, of a match with a reference patch, as measured against true poses. With the surface known the warp
/// is right, and the error stays below a tenth of a pixel for as long as the track lives. At the rims of things, and
/// far more beyond the reach of the depth camera, the patch slides over what it shows.
double matchSigma(const PatchSurface& surface);

}  // namespace vip_slam
