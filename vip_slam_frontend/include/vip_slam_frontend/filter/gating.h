// SPDX-License-Identifier: BSD-3-Clause
// Chi-square gate on measurement rows before they enter the filter.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

// What counts as an outlier, one value per meaning.
/// Probability of a consistent measurement to pass a chi-square gate.
constexpr double kGateProbability = 0.95;
/// Innovation gate of a motion or of a surface patch, sigmas: loose, since their errors are not Gaussian. So far from
/// zero a number of the calibration surely is another one, and from its prior not to be believed.
constexpr double kGateSigmas = 4.0;
/// Readings that belong to one surface lie within this many sigmas of it.
constexpr double kReadingSigmas = 3.5;
/// Residuals lose weight beyond this many sigmas (Huber).
constexpr double kHuberSigmas = 1.5;

/// From fewer samples no share or median is taken.
constexpr int kEnough = 20;

/// Quantile of the chi-square distribution, probability in ]0, 1[, dof >= 1.
double chiSquareQuantile(double probability, int dof);

/// Remembers the quantiles of one probability.
class Gate {
 public:
  explicit Gate(double probability);
  double threshold(int dof) const;

 private:
  Eigen::VectorXd table_;
  double probability_;
};

}  // namespace vip_slam
