// SPDX-License-Identifier: BSD-3-Clause
// States of the filter that may drift: biases of the IMU as it warms up, the delay of images whose clock is another.
// How fast is in no configuration; the corrections of the filter tell. Source: the whiteness of innovations, Mehra
// 1970, "On the identification of variances and adaptive Kalman filtering".
#pragma once

#include <array>

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/filter_options.h"

namespace vip_slam::frontend {

/// What is summed up over so long, s, shares hardly any measurements with the next such stretch: more than the time of
/// the filter's window.
constexpr double kStretch = 1.0;

/// Random walk of a state that may drift: a bias of the IMU as it warms up, the delay of images whose clock is another.
class RandomWalk {
 public:
  /// Densities, unit of the state / sqrt(s): as configured, and the largest that is drift: what goes faster is another
  /// fault, and is not followed.
  RandomWalk(double configured, double largest) : configured_(configured), largest_(largest), density_(configured) {}
  /// One update: what it added to the state, and the state's variances before and after it. Always of one dimension.
  void add(const Eigen::VectorXd& correction, const Eigen::VectorXd& before, const Eigen::VectorXd& after);
  /// Ends a stretch. How surely the state drifts, in sigmas: the correlation of its corrections with those
  /// of the stretch before.
  double closeStretch();
  /// Whether the last stretch asks for more than is drift.
  bool isBeyondDrift() const { return needed_ > largest_; }
  /// To what the drift that the last stretch saw asks for.
  void raise();
  /// As far as the last stretch says that it is larger than need be.
  void lower();
  double density() const { return density_; }
  double factor() const { return density_ / configured_; }
  /// More than once, since once is chance.
  bool drifts() const { return raised_ > 1; }

 private:
  bool isRaised() const { return density_ > configured_; }

  double configured_, largest_, density_;
  int raised_ = 0;           ///< times
  Eigen::ArrayXd sum_;       ///< of the corrections of this stretch; empty: none yet
  Eigen::ArrayXd lost_;      ///< what they have removed of the variances
  double variance_ = 0;      ///< of the state at the stretch's beginning, all axes
  Eigen::ArrayXd whitened_;  ///< sum of the last stretch, over the root of what was removed
  double needed_ = 0;        ///< density that the last stretch asks for
  double level_ = 1;         ///< mean square of the whitened sums: above 1, the filter's noise is too small
  int stretches_ = 0;
};

/// Finds out which of biases and delay drift by more than their random walks allow. The corrections by a consistent
/// filter are white; drift shows as corrections that go on in one direction. Only the walk of the one that drifts most
/// surely is raised at a time: the others may be off because of it.
class DriftMonitor {
 public:
  /// A state drifts by its initial sigma within a second at most. Without `adapt_imu_noise` the walks stay as
  /// configured, and the delay does not change.
  DriftMonitor(const ImuNoise& noise, const FilterOptions& options);
  enum State { kGyroBias, kAccelBias, kDelay, kStates };
  /// One update of one of them, see RandomWalk::add().
  void add(State state, const Eigen::VectorXd& correction, const Eigen::VectorXd& before, const Eigen::VectorXd& after);
  /// After all updates of an image at time t, s.
  void endImage(double t);
  const RandomWalk& of(State state) const { return walks_[state]; }
  void reset();

 private:
  bool adapt_;
  std::array<RandomWalk, kStates> given_, walks_;
  double begin_ = -1e300;  ///< of the present stretch, s
};

}  // namespace vip_slam::frontend
