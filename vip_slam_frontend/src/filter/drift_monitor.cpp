// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/drift_monitor.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {
namespace {

// Corrections are summed up over so long, s: a little more than the filter's window, whose images share errors.
constexpr double kStretch = 0.5;
constexpr double kLeastDelayWalk = 1e-5;  // s / sqrt(s), once the delay is seen to drift
constexpr double kSlowestFall = 0.5;      // least factor on the variance of a random walk from one stretch to the next
constexpr double kLevelGain = 0.05;       // of the mean square of the sums, per stretch

}  // namespace

void RandomWalk::add(const Eigen::VectorXd& correction, const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
  if (!correction.allFinite() || !before.allFinite() || !after.allFinite()) return;
  if (sum_.size() == 0) {
    variance_ = before.sum();
    sum_ = lost_ = Eigen::ArrayXd::Zero(correction.size());
  }
  sum_ += correction.array();
  lost_ += (before - after).array();
}

double RandomWalk::closeStretch() {
  // An update that is linearised anew may leave less known than before: then nothing is said.
  const Eigen::ArrayXd now = (lost_ > 0).select(sum_ / lost_.abs().sqrt(), 0.0);
  const double dof = static_cast<double>(now.size());
  double sigmas = 0;
  if (now.size() > 0) {
    const double product = whitened_.size() == now.size() ? (now * whitened_).sum() / dof : 0.0;
    sigmas = product * std::sqrt(dof) / std::max(1.0, level_);
    // The product of two stretches is free of their noise, and what the updates add up to is as small a share of the
    // drift as they have removed of the variance.
    const double share = std::clamp(lost_.sum() / variance_, 1e-9, 1.0);
    needed_ = std::sqrt(std::max(0.0, product) * lost_.max(0.0).mean() / kStretch) / share;
    level_ += std::max(kLevelGain, 1.0 / ++stretches_) * (now.square().sum() / dof - level_);
  }
  whitened_ = now;
  sum_.resize(0);
  lost_.resize(0);
  return sigmas;
}

void RandomWalk::raise() {
  density_ = std::max({density_, least_, needed_});
  ++raised_;
}

void RandomWalk::lower() {
  if (!isRaised() || whitened_.size() == 0) return;
  const double ratio = whitened_.square().sum() / static_cast<double>(whitened_.size());
  density_ *= std::sqrt(std::clamp(ratio, kSlowestFall, 1.0));
  if (density_ < std::max(least_, configured_)) density_ = configured_;
}

DriftMonitor::DriftMonitor(const ImuNoise& noise, const FilterOptions& options)
    : adapt_(options.adapt_imu_noise),
      given_{RandomWalk(noise.gyro_random_walk, 0, options.sigma_bias_gyro),
             RandomWalk(noise.accel_random_walk, 0, options.sigma_bias_accel),
             RandomWalk(0, kLeastDelayWalk, options.calibration.sigma_time_offset)},
      walks_(given_) {}

void DriftMonitor::add(State state, const Eigen::VectorXd& correction, const Eigen::VectorXd& before,
                       const Eigen::VectorXd& after) {
  walks_[state].add(correction, before, after);
}

void DriftMonitor::endImage(double t) {
  const double seconds = t - begin_;
  if (!adapt_ || (seconds >= 0 && seconds < kStretch)) return;
  begin_ = t;
  double sigmas = kGateSigmas;
  RandomWalk* drifting = nullptr;
  for (RandomWalk& walk : walks_) {
    const double its = walk.closeStretch();
    if (!(its > sigmas) || walk.isBeyondDrift()) continue;
    sigmas = its;
    drifting = &walk;
  }
  for (RandomWalk& walk : walks_) &walk == drifting ? walk.raise() : walk.lower();
}

void DriftMonitor::reset() {
  walks_ = given_;
  begin_ = -1e300;
}

}  // namespace vip_slam::frontend
