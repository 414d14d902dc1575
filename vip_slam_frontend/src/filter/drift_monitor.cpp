// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/drift_monitor.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {
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
    level_ += 1.0 / (stretches_ = std::min(stretches_ + 1, kEnough)) * (now.square().sum() / dof - level_);
  }
  whitened_ = now;
  sum_.resize(0);
  lost_.resize(0);
  return sigmas;
}

void RandomWalk::raise() {
  density_ = std::max(density_, needed_);
  ++raised_;
}

void RandomWalk::lower() {
  if (!isRaised() || whitened_.size() == 0) return;
  const double ratio = whitened_.square().sum() / static_cast<double>(whitened_.size());
  // Halfway: one stretch alone may be small by chance.
  density_ *= std::sqrt(0.5 * (1.0 + std::min(ratio, 1.0)));
  // What hardly adds to the state's variance in a stretch is none.
  const bool negligible = density_ * density_ * kStretch * static_cast<double>(whitened_.size()) < variance_ / kEnough;
  if (negligible || density_ < configured_) density_ = configured_;
}

DriftMonitor::DriftMonitor(const ImuNoise& noise, const FilterOptions& options)
    : adapt_(options.adapt_imu_noise),
      given_{RandomWalk(noise.gyro_random_walk, options.sigma_bias_gyro),
             RandomWalk(noise.accel_random_walk, options.sigma_bias_accel),
             RandomWalk(0, options.calibration.sigma_time_offset)},
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
