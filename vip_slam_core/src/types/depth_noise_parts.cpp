#include "vip_slam_core/types/depth_noise_parts.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr int kTerms = 6, kPlaneTerms = 3;  // of a quadric, and those of a plane
constexpr double kPriorSurfaces = 2.0;              // surfaces that the noise model counts as
// Variance of a surface's shared error over that of its bend.
constexpr double kOverBend = 4.0;
constexpr std::size_t kNewestShapes = 300;  // observations that are looked at
constexpr double kMedianOverMean = 0.79;  // of a chi square with three degrees of freedom over its mean
constexpr double kLeastFactor = 1e-3, kMostFactor = 10.0;

double posterior(std::vector<double> factors) {
  const auto n = static_cast<double>(factors.size());
  if (n == 0) return 1;
  const double found = std::max(0.0, upperMedian(std::move(factors)));
  return std::clamp((kPriorSurfaces + n * found) / (kPriorSurfaces + n), kLeastFactor, kMostFactor);
}

}  // namespace

std::optional<DepthNoiseParts> surfaceShape(const PlaneObservation& observation) {
  const double shared = sharedVariance(observation), weight = observation.G(3, 3) / observation.weight_scale;
  const auto n = static_cast<double>(observation.points.size());
  if (!(shared > 0) || n < 4 * kTerms) return std::nullopt;
  const Eigen::Matrix4d G = observation.G / (observation.weight_scale * weight);
  const Eigen::Vector3d centre = G.topRightCorner<3, 1>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(Eigen::Matrix3d(G.topLeftCorner<3, 3>() - centre * centre.transpose()));
  const Eigen::Vector3d extent = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  if (!(extent(1) > 0)) return std::nullopt;
  Eigen::Matrix<double, kTerms, kTerms> H = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Eigen::Matrix<double, kTerms, 1> g = Eigen::Matrix<double, kTerms, 1>::Zero();
  double squares = 0;
  for (const PlaneSample& point : observation.points) {
    const Eigen::Vector3d q = eigen.eigenvectors().transpose() * (point.p_C.cast<double>() - centre);
    const double x = q(2) / extent(2), y = q(1) / extent(1), r = q(0) / point.sigma;
    Eigen::Matrix<double, kTerms, 1> terms;
    terms << 1, x, y, x * x, x * y, y * y;
    terms /= point.sigma;
    H.noalias() += terms * terms.transpose();
    g += terms * r;
    squares += r * r;
  }
  // The points' moments are weighted, so the plane's terms are nothing: what is explained is the bend.
  const double bend = g.dot(H.ldlt().solve(g));
  if (!std::isfinite(bend)) return std::nullopt;
  DepthNoiseParts parts;
  parts.white = std::max(0.0, squares - bend) / (n - kTerms);
  parts.shared = kOverBend * (bend - (kTerms - kPlaneTerms) * parts.white) / weight / shared;
  return parts;
}

DepthNoiseParts depthNoiseParts(const std::vector<DepthNoiseParts>& surfaces) {
  std::vector<double> white, shared;
  for (const DepthNoiseParts& s : surfaces) {
    white.push_back(s.white);
    shared.push_back(s.shared / kMedianOverMean);
  }
  return {posterior(std::move(white)), posterior(std::move(shared))};
}

DepthNoiseParts depthNoiseParts(const std::vector<const PlaneObservation*>& newest_first) {
  std::vector<DepthNoiseParts> surfaces;
  for (std::size_t k = 0; k < std::min(newest_first.size(), kNewestShapes); ++k)
    if (const auto shape = surfaceShape(*newest_first[k])) surfaces.push_back(*shape);
  return depthNoiseParts(surfaces);
}

}  // namespace vip_slam
