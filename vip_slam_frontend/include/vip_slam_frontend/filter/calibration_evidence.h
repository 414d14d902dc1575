// SPDX-License-Identifier: BSD-3-Clause
// What the data say of a block of calibration numbers, gathered beside the filter, which keeps each at an adopted value
// until they are sure of another. A filter that follows such numbers from their wide priors carries each error of its
// first seconds in its trajectory; one that leaves them out calls itself too sure. Here the filter has them as states
// with sigmas which every step takes back to the adopted values: what the step said of them is the difference of the
// block's marginal information, and goes here, with what it says of each given the others. Sources: the information
// form of recursive least squares; for errors that readings share the sandwich covariance over clusters (Liang and
// Zeger 1986, "Longitudinal data analysis using generalized linear models").
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam::frontend {

/// A number and its one sigma; sigma 0: not known.
struct Estimate {
  double value = 0, sigma = 0;
};

/// A Gaussian's exponent: information (n x n), and information times value.
struct Likelihood {
  Eigen::MatrixXd information;
  Eigen::VectorXd weighted;

  static Likelihood none(int n) { return {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)}; }
  static Likelihood of(const Eigen::VectorXd& value, const Eigen::MatrixXd& covariance);
  void add(const Likelihood& other);
  /// Without number k, which had this prior: what is said of the others. Its row and column become zero.
  void marginalise(int k, const Estimate& prior);
};

class CalibrationEvidence {
 public:
  /// Scatter of stretches over what the filter's sigmas say, as a variance, before there are many of them: 2 to 4 on a
  /// phone (real), less than 1 where noise is white.
  static constexpr double kUsualScatter = 4;
  /// The filter holds a number with this share of its prior's sigma: with all of it, the innovation gates let more
  /// outliers in (a phone, real: odometry 1.94 instead of 1.62 cm). What a step says of the number is the same. Smaller
  /// differences do not matter.
  static constexpr double kHeld = 0.25;

  /// `prior`: of the sensor's configuration.
  explicit CalibrationEvidence(const std::vector<Estimate>& prior);
  /// Numbers j and k have, apart from their own priors, the same value within `sigma`.
  void couple(int j, int k, double sigma);

  double adopted(int k) const { return adopted_(k); }
  double sigmaOfAdopted(int k) const;
  /// What the filter is to have of a number at the beginning of each step: the adopted value, with a share of the
  /// prior's sigma until data know it better.
  Estimate held(int k) const;
  /// What one step said, at t seconds.
  void add(double t, const Likelihood& step);
  /// With the priors, and with all other numbers unknown within theirs. The sigma grows with the scatter of stretches
  /// of some seconds, by whose errors the filter's own sigma is too small where noise is not white.
  Estimate estimate(int k) const { return {found_(k), sigma_(k)}; }
  /// Adopts each estimate that is sure to differ from the adopted value, and from then on whenever that is more than a
  /// sigma off; back to the prior's value where it goes beyond belief. True when an adopted value has changed.
  bool adopt();
  /// Whether the estimate is beyond what is believed of the prior, and sure: something else is wrong.
  bool contradicts(int k) const;
  /// Variance of the adopted value, an estimate that is not sure yet or beyond belief included, above that of held().
  double varianceBeyondHeld(int k) const;
  /// Nothing is known of number k; the prior's value, with this sigma, is adopted.
  void restart(int k, double sigma);

 private:
  void estimate();
  /// Between the adopted value of number k and an estimate that is sure to differ.
  double sureSigmas(int k) const;

  std::vector<Estimate> prior_;
  Likelihood prior_likelihood_;
  Eigen::VectorXd adopted_;
  Eigen::VectorXd found_, sigma_;
  Eigen::ArrayXd degrees_;  ///< of freedom of each sigma: how many stretches it comes from (Satterthwaite 1946)
  double begin_ = 0;        ///< of the newest stretch, s
  double length_;           ///< of a stretch, s
  std::vector<Likelihood> stretches_;
};

}  // namespace vip_slam::frontend
