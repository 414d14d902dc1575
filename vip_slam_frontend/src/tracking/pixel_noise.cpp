// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/types/sliding_tracks.h"

namespace vip_slam {

namespace {

// Sigma of a grey level: besides image noise it covers each patch's own errors by interpolation, blur, shading, slope.
// With this value, grey levels, the normalised errors of faint and strong patches against true poses are equal.
constexpr double kGrey = 5.0;
// Factor on a match's residual, which replaces kGrey when it is larger.
constexpr double kResidual = 2.0;
// Remaining sigma of a patch with infinite contrast, px: the unit of the covariance.
constexpr double kFloor = 0.05;
constexpr double kAtEdge = 2.5;
// One sigma of a match, px, for a patch on a known plane (wide, narrow), with depth but no plane, without depth.
constexpr double kWideSurface = 0.06, kKnownSurface = 0.08, kUnclearSurface = 0.25, kNoSurface = 0.6;
// The back end recognises sliding tracks by their sigma, so it must separate the kinds of patches.
static_assert(kUnclearSurface < kSlidingPixelSigma && kNoSurface > kSlidingPixelSigma,
              "the kinds of tracks cannot be told");
// Added to the texture, (grey levels / px)^2, so that a patch on a straight edge keeps a finite covariance.
constexpr double kMinTexture = 20.0;

}  // namespace

Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, double wander) {
  const double grey = std::max(kGrey, kResidual * residual) / kFloor;
  const Eigen::Matrix2d G = texture + kMinTexture * Eigen::Matrix2d::Identity();
  Eigen::Matrix2d covariance;
  covariance << G(1, 1), -G(0, 1), -G(1, 0), G(0, 0);
  covariance *= grey * grey / (G(0, 0) * G(1, 1) - G(0, 1) * G(1, 0));
  covariance += Eigen::Matrix2d::Identity();
  covariance *= wander * wander;
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  Eigen::Matrix2d L;
  L << 1.0 / root(0, 0), 0.0, -root(1, 0) / (root(0, 0) * root(1, 1)), 1.0 / root(1, 1);
  return L;
}

double matchSigma(const PatchSurface& surface, double magnification) {
  const double m = std::max(1.0, magnification), growth = m * std::sqrt(m);
  if (surface.known) return growth * (surface.wide ? kWideSurface : kKnownSurface);
  return growth * (surface.depth > 0 ? kUnclearSurface : kNoSurface);
}

double patchWander(const PatchSurface& surface, bool at_edge, bool missed) {
  const double sigma = std::max(surface.known ? kKnownSurface : matchSigma(surface, 1.0), missed ? kFlowSigma : 0.0);
  return std::max(at_edge ? kAtEdge : 1.0, sigma / kKnownSurface);
}

}  // namespace vip_slam
