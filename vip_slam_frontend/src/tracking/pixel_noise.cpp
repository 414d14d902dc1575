#include "vip_slam_frontend/tracking/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_core/types/sliding_tracks.h"

namespace vip_slam {

namespace {

// Beside noise the scatter of a grey level has a part of its own for every patch: interpolation, blur, shading, slope.
// This much in grey levels brings the errors of faint and strong patches, measured against true poses, to one level.
constexpr double kGrey = 5.0;
// A match that leaves more than noise behind is as uncertain as what it left.
constexpr double kResidual = 2.0;
// What is left over for a patch of infinite contrast, px: the unit.
constexpr double kFloor = 0.05;
constexpr double kAtEdge = 2.5;
// Matches with a patch whose surface the depth shows (wide, narrow), shows in parts, does not show; px.
constexpr double kWideSurface = 0.06, kKnownSurface = 0.08, kUnclearSurface = 0.25, kNoSurface = 0.6;
// What reads the sigma tells by it which tracks slide.
static_assert(kUnclearSurface < kSlidingPixelSigma && kNoSurface > kSlidingPixelSigma,
              "the kinds of tracks cannot be told");
// (grey levels / px)^2 that no patch falls below, so that a bare edge keeps a finite covariance.
constexpr double kLeastTexture = 20.0;

}  // namespace

Eigen::Matrix2d pixelWhitening(const Eigen::Matrix2d& texture, double residual, double wander) {
  const double grey = std::max(kGrey, kResidual * residual) / kFloor;
  const Eigen::Matrix2d G = texture + kLeastTexture * Eigen::Matrix2d::Identity();
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
