// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/disparity_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include "curve_equations.h"
#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

// An error is learnt above three sigmas and, the first time, kFirst, 1/m, when each half of the planes gives at least
// kMinShare of it. In maps with exact depth errors of up to 0.26 mm at one metre are estimated.
constexpr double kMinShare = 0.5, kFirst = 3e-4;
constexpr double kMaxError = 0.01;  // 1/m; a centimetre at one metre is more than a calibration error
constexpr double kFurther = 4e-5;   // 1/m; smallest further change once there is an error

using Keyframes = std::vector<const MapKeyframe*>;

/// 1/m; 0 where it cannot be told.
double fit(const Keyframes& keyframes, const PlaneSet& planes, const DepthNoise& noise) {
  const int entries = curveEntries(noise);
  const double certain = 1 / (kDepthOffSigma * kDepthOffSigma);
  const Eigen::Vector3d prior(certain, certain, 0);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();  // offset, scale, error
  for (int round = 0; round < kFitRounds; ++round) {
    Eigen::MatrixX3d J(entries, 3);
    Eigen::VectorXd value(entries);
    for (int i = 0; i < entries; ++i) {
      const double z = i * DepthCurve::kStep, added = addedForDisparity(x(2), z);
      J.row(i) << 1, z, (z + added) * (z + added);
      value(i) = x(0) + x(1) * z + added;
    }
    const CurveEquations equations = curveEquations(keyframes, planes, value, noise);
    Eigen::Matrix3d H = J.transpose() * equations.H * J / equations.scatter;
    H.diagonal() += prior;
    const Eigen::Vector3d g = J.transpose() * equations.g / equations.scatter + prior.cwiseProduct(x);
    x -= H.ldlt().solve(g);
    if (!x.allFinite()) return 0;
  }
  return x(2);
}

/// Standard deviation of the fit, 1/m, by the jackknife over keyframes. All points of a keyframe share its pose's
/// error, so that points do not count, keyframes do. What the normal equations say would be too small, as a
/// redescending loss is not a square: with poses that are off by 2 cm, half of what it is.
double sigmaOfFit(const Keyframes& keyframes, const PlaneSet& planes, const DepthNoise& noise) {
  const auto without = [&](const Keyframes& others) { return std::make_optional(fit(others, planes, noise)); };
  return jackknifeSigma(keyframes, without).value_or(std::numeric_limits<double>::infinity());
}

}  // namespace

std::optional<double> fitDisparityError(const Map& map, const DepthNoise& noise, bool again) {
  if (!measuresDisparity(noise.type)) return std::nullopt;
  const Keyframes keyframes = newestKeyframesOnPlanes(map);
  if (2 * int(keyframes.size()) < kGroups) return std::nullopt;
  const PlaneSet planes = allPlanes(map);
  const double found = fit(keyframes, planes, noise);
  if (std::abs(found) > kMaxError || !(std::abs(found) > (again ? kFurther : kFirst))) return std::nullopt;
  const double sigma = sigmaOfFit(keyframes, planes, noise);
  if (!(std::abs(found) > (again ? 1.0 : kNoiseSigmas) * sigma)) return std::nullopt;
  if (again) return found;
  // Surfaces that are not exactly planar give an error as well, but each plane a different one.
  const auto [first, second] = halves(keyframes, planes);
  for (const PlaneSet& half : {first, second}) {
    if (!(fit(keyframes, half, noise) / found > kMinShare)) return std::nullopt;
  }
  return found;
}

std::string disparityDifference(double error) {
  if (error == 0) return "";
  return formatted(
      "depth reads too %s by more the farther, %.1f mm at 1 m and %.1f mm at 3 m, as with disparities that are all "
      "off by the same; it is corrected for, but the camera should be calibrated anew, or depth/curve in the "
      "sensor's configuration have it from the start",
      error < 0 ? "long" : "short", 1e3 * std::abs(addedForDisparity(error, 1)),
      1e3 * std::abs(addedForDisparity(error, 3)));
}

}  // namespace vip_slam
