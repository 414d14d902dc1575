// SPDX-License-Identifier: BSD-3-Clause
// What the data say of one calibration number, gathered beside the filter, which keeps the number at an adopted value
// until they are sure of another. A filter that follows such a number from its wide prior on carries each error of its
// first seconds in its trajectory; one that leaves it out calls itself too sure. Here the filter has it as a state with
// its prior's sigma, which every step takes back to the adopted value: what the step said of it is the difference of
// the marginals' information, and goes here.
#pragma once

#include <vector>

namespace vip_slam::frontend {

/// A number and its one sigma; sigma 0: not known.
struct Estimate {
  double value = 0, sigma = 0;
};

/// The sum of two Gaussians' exponents: information, and information times value.
struct Likelihood {
  double information = 0, weighted = 0;

  void add(const Likelihood& other) {
    information += other.information;
    weighted += other.weighted;
  }
};

/// What an update made of a state that had the marginal `before`.
Likelihood learntBetween(const Estimate& before, const Estimate& after);

class CalibrationEvidence {
 public:
  /// Scatter of stretches over what the filter's sigmas say, as a variance, before there are many of them: 2 to 4 on a
  /// phone (real), less than 1 where noise is white.
  static constexpr double kUsualScatter = 4;

  /// `prior`: of the sensor's configuration.
  explicit CalibrationEvidence(const Estimate& prior) : prior_(prior), adopted_(prior.value) {}

  double adopted() const { return adopted_; }
  /// What the filter is to have of the number at the beginning of each step: the adopted value, with a share of the
  /// prior's sigma until data know it better.
  Estimate held() const;
  /// What one step said, at t seconds.
  void add(double t, const Likelihood& step);
  /// With the prior. The sigma grows with the scatter of stretches of some seconds, by whose errors the filter's own
  /// sigma is too small where noise is not white.
  Estimate estimate() const;
  /// Adopts the estimate when it is sure to differ from the adopted value, and later again when it has become much
  /// surer; back to the prior's value when it goes beyond belief. True when the adopted value has changed.
  bool adopt();
  /// Whether the estimate is beyond what is believed of the prior, and sure: something else is wrong.
  bool contradicts() const;
  /// Nothing is known, the prior's value is adopted.
  void reset() { *this = CalibrationEvidence(prior_); }

 private:
  Estimate prior_;
  double adopted_;
  double adopted_information_ = 0;  ///< of the estimate when it was adopted; 0: the prior's value is
  double begin_ = 0;                ///< of the newest stretch, s
  std::vector<Likelihood> stretches_;
};

}  // namespace vip_slam::frontend
