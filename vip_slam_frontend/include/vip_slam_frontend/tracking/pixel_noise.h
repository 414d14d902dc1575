// How well a patch fixes its pixel. Grey levels scatter alike in every direction, the pixel does not: along a straight
// edge hardly anything changes when the patch is moved, and a faint corner moves further than a strong one under the
// same noise. The covariance of a least-squares match is sigma_grey^2 G^-1 with G the sum of the gradients' products.
#pragma once

#include <Eigen/Core>

#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

/// Lower triangular L with L^T L the inverse of the pixel's covariance in units of the best patches' variance:
/// residuals in pixels times L / sigma_px are white. `texture`: sum of gradient products, (grey levels / px)^2;
/// `residual`: of the match, grey levels; `wander`: factor on the sigmas, see there.
Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, double wander);

/// One sigma, px, of a match with a reference patch, as measured against true poses. With the surface known the warp
/// is right, and the error stays below a tenth of a pixel for as long as the track lives, but it grows with the patch:
/// what is wrong in the reference by as much, and its blur, in which more of the motion hides, by the rest. At the rims
/// of things, and far more beyond the reach of the depth camera, the patch slides over what it shows. `magnification`:
/// the larger one of the newest image over the reference; ceilings and floors grow along the motion most.
double matchSigma(const PatchSurface& surface, double magnification);

/// How many times farther than the best patches this one may be off. What slides does so as smoothly as the camera
/// moves: residuals over a few images do not show it, but points that are taken to be fixed pull at the motion.
/// `at_edge`: the newest view shows two surfaces there, or one that the depth does not explain, so that what the patch
/// shows changes. `missed`: the patch was not found in the newest image, whose pixel is optical flow's alone.
double patchWander(const PatchSurface& surface, bool at_edge, bool missed);

/// One sigma of optical flow from image to image alone, px.
constexpr double kFlowSigma = 0.5;

}  // namespace vip_slam
