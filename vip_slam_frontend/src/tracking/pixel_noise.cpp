// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include "vip_slam_frontend/filter/gating.h"

#include "vip_slam_core/types/sliding_tracks.h"

namespace vip_slam {

namespace {

// One sigma of a match, px, for a patch on a known plane (wide, narrow) and with depth but no plane. Without depth it
// slides as optical flow does. What is left of the sigma at infinite contrast, the unit of the covariance, is that of
// the best patches.
constexpr double kWideSurface = 0.06, kKnownSurface = 0.08, kUnclearSurface = 0.25;
// The back end recognises sliding tracks by their sigma, so it must separate the kinds of patches.
static_assert(kUnclearSurface < kSlidingPixelSigma && kFlowSigma > kSlidingPixelSigma,
              "the kinds of tracks cannot be told");

}  // namespace

Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, double wander) {
  // What a match leaves unexplained is alike in neighbouring pixels, so it adds to the noise in full.
  const double grey = kGreySigma + residual;
  // Along a straight edge a patch slides no farther than the limit against optical flow.
  const Eigen::Matrix2d G =
      texture + std::pow(kGreySigma / (kGateSigmas * kFlowSigma), 2) * Eigen::Matrix2d::Identity();
  Eigen::Matrix2d covariance;
  covariance << G(1, 1), -G(0, 1), -G(1, 0), G(0, 0);
  covariance *= std::pow(grey / kWideSurface, 2) / (G(0, 0) * G(1, 1) - G(0, 1) * G(1, 0));
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
  return growth * (surface.depth > 0 ? kUnclearSurface : kFlowSigma);
}

double patchWander(const PatchSurface& surface, bool at_edge, bool missed) {
  double sigma = surface.known ? kKnownSurface : matchSigma(surface, 1.0);
  if (at_edge) sigma = std::max(sigma, kUnclearSurface);
  if (missed) sigma = std::max(sigma, kFlowSigma);
  return sigma / kKnownSurface;
}

}  // namespace vip_slam
