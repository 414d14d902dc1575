// SPDX-License-Identifier: BSD-3-Clause
// Pixel covariance of a patch match. It depends on direction and contrast: along a straight edge the patch can slide
// almost freely, and the same image noise shifts a faint corner further than a strong one. The covariance of a
// least-squares match is sigma_grey^2 G^-1 with G the sum of the gradients' products.
#pragma once

#include <Eigen/Core>

#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

/// Lower triangular L with L^T L the inverse of the pixel's covariance in units of the best patches' variance:
/// residuals in pixels times L / sigma_px are white. `texture`: sum of gradient products, (grey levels / px)^2;
/// `residual`: of the match, grey levels; `wander`: factor on the sigmas, see patchWander().
Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, double wander);

/// One sigma, px, of a match with a reference patch, as measured against true poses. With a known surface the warp is
/// right and the error stays below a tenth of a pixel, times magnification^1.5: errors of the reference are enlarged
/// with the patch, and its enlarged blur adds the rest. At depth edges, and far more beyond the reach of the depth
/// camera, the patch slides over what it shows. `magnification`: of the newest over the reference image, along the
/// larger axis.
double matchSigma(const PatchSurface& surface, double magnification);

/// Factor on the sigma of the best patches, for patches that slide: sliding follows the camera's motion smoothly, so
/// residuals over a few images do not show it, but it biases the motion. `at_edge`: the newest view shows two surfaces
/// there, or one that the depth does not explain, so that what the patch shows changes. `missed`: the patch was not
/// found in the newest image, and the pixel is from optical flow alone.
double patchWander(const PatchSurface& surface, bool at_edge, bool missed);

/// One sigma of optical flow from image to image alone, px.
constexpr double kFlowSigma = 0.5;
/// One sigma of a grey level: besides image noise it covers each patch's own errors by interpolation, blur, shading,
/// slope. With this value the normalised errors of faint and strong patches against true poses are equal.
constexpr double kGreySigma = 5.0;

}  // namespace vip_slam
