#include "vip_slam_backend/optimisation/disparity_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "curve_equations.h"
#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kOffsetSigma = 0.02, kScaleSigma = 0.02;  // m and share, priors of the nuisance offset and scale
constexpr int kFitRounds = 4;                              // of reweighting and relinearisation
// An error is significant above kCertain sigmas and, the first time, kFirst, 1/m, when each half of the planes gives at
// least kMinShare of it. In maps with exact depth errors of up to 0.26 mm at one metre are estimated.
constexpr double kCertain = 3.0, kMinShare = 0.5, kFirst = 3e-4;
constexpr double kMaxError = 0.01;  // 1/m; a centimetre at one metre is more than a calibration error
constexpr double kFurther = 4e-5;   // 1/m; smallest further change once there is an error

struct DisparityError {
  double value = 0, sigma = 0;  ///< 1/m
};

DisparityError fit(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes, const DepthNoise& noise) {
  const int entries = curveEntries(noise);
  const Eigen::Vector3d prior(1 / (kOffsetSigma * kOffsetSigma), 1 / (kScaleSigma * kScaleSigma), 0);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();  // offset, scale, error
  DisparityError found;
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
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(H);
    x -= ldlt.solve(g);
    if (!x.allFinite()) return {};
    // The larger sigma of two: by the scatter of points, and by that of keyframes, whose poses have errors.
    const Eigen::Vector3d row = ldlt.solve(Eigen::Vector3d::Unit(2));
    const Eigen::VectorXd moved = equations.shares.transpose() * (J * row) / equations.scatter;
    found = {x(2), std::sqrt(std::max({0.0, row(2), moved.squaredNorm()}))};
  }
  return found;
}

}  // namespace

std::optional<double> fitDisparityError(const Map& map, const DepthNoise& noise, bool again) {
  if (!measuresDisparity(noise.type)) return std::nullopt;
  const std::vector<const MapKeyframe*> keyframes = newestKeyframesOnPlanes(map);
  if (int(keyframes.size()) < kMinCurveKeyframes) return std::nullopt;
  const PlaneSet planes = allPlanes(map);
  const DisparityError found = fit(keyframes, planes, noise);
  if (std::abs(found.value) > kMaxError) return std::nullopt;
  if (again) {
    if (std::abs(found.value) > std::max(found.sigma, kFurther)) return found.value;
    return std::nullopt;
  }
  if (!(std::abs(found.value) > std::max(kCertain * found.sigma, kFirst))) return std::nullopt;
  // Surfaces that are not exactly planar give an error as well, but each plane a different one.
  const auto [first, second] = halves(keyframes, planes);
  for (const PlaneSet& half : {first, second}) {
    if (!(fit(keyframes, half, noise).value / found.value > kMinShare)) return std::nullopt;
  }
  return found.value;
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
