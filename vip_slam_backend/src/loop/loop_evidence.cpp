// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/loop_evidence.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace vip_slam {
namespace {

// Shares of the cells that a match explains. True places: 202 candidates of rendered sequences, mean 0.74, and 48 of
// real recordings, 0.66. Wrong ones: 246 of rendered sequences, most of them bays of corridors that look alike, 0.28.
// Both are taken wider than fitted, since candidates come in series.
constexpr double kTrueA = 2.6, kTrueB = 1.4, kWrongA = 2.2, kWrongB = 5.8;
// Share of wrong places that look as much like the place as it does itself: bays of one shelf, floors of one building.
constexpr double kTwins = 0.02;

double logBeta(double a, double b) { return std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b); }

// ln P(explained of the cells), up to the binomial coefficient, which both hypotheses share.
double betaBinomial(const PlaceCoverage& coverage, double a, double b) {
  return logBeta(a + coverage.explained_cells, b + coverage.cells - coverage.explained_cells) - logBeta(a, b);
}

}  // namespace

double matchEvidence(const PlaceCoverage& coverage) {
  const double ratio = betaBinomial(coverage, kTrueA, kTrueB) - betaBinomial(coverage, kWrongA, kWrongB);
  return -std::log(kTwins + (1 - kTwins) * std::exp(-ratio));
}

double poseEvidence(double chi2, const Eigen::Matrix3d& position_covariance, double extent) {
  constexpr double kDegrees = 4, kDimensions = 4, kWays = 4;
  const double variance =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(position_covariance, Eigen::EigenvaluesOnly).eigenvalues()(2);
  const double known = 0.5 * std::log(extent * extent / (2 * M_PI * std::max(variance, 1e-6)));
  return std::log(kWays) + std::max(0.0, known) - 0.5 * (kDegrees + kDimensions) * std::log1p(chi2 / kDegrees);
}

}  // namespace vip_slam
