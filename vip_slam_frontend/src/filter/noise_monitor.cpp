// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/noise_monitor.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

// The initial sigma is a guess: during the first kGuessed images its logarithm may be off by this much, later by 1.
constexpr double kMaxOfGuess = 3.0;
constexpr int kGuessed = 3;
constexpr double kGain = 0.05;           // per image, of the moving averages
constexpr double kMaxCorrection = 20.0;  // limits the influence of a single image
// Three sigmas above 1 for the moving average of a consistent correction with six degrees of freedom.
constexpr double kContradiction = 1.3;
constexpr double kManyGated = 0.3;
constexpr double kWidest = 30.0;
// Below this angular rate stamp jitter cannot be separated from the gyro's noise, rad/s.
constexpr double kMinTurn = 0.1;
// Range of the estimated stamp jitter, s: less does no harm, more means a wrong IMU.
constexpr double kMinJitter = 1e-4, kMaxJitter = 5e-3;

}  // namespace

NoiseMonitor::NoiseMonitor(double sigma, double lowest, double highest)
    : sigma_(std::clamp(sigma, lowest, std::max(lowest, highest))), min_(lowest), max_(highest) {}

void NoiseMonitor::add(double chi2_per_dof, int dof) {
  if (dof < kEnough || !(chi2_per_dof > 0) || !std::isfinite(chi2_per_dof)) return;
  // Plain average over the first 20 updates, then exponential: a wrong initial value is forgotten quickly.
  const double gain = 1.0 / (updates_ = std::min(updates_ + 1, 20));
  const double most = updates_ <= kGuessed ? kMaxOfGuess : 1.0;
  const double step = gain * std::clamp(0.5 * std::log(chi2_per_dof), -most, most);
  sigma_ = std::clamp(sigma_ * std::exp(step), min_, std::max(min_, max_));
}

void StampMonitor::add(const Eigen::Vector3d& omega, const Eigen::Vector3d& turned, const Eigen::Matrix3d& lost) {
  const double expected = omega.dot(lost * omega);
  if (!adapt_ || omega.norm() < kMinTurn || !(expected > 0) || !turned.allFinite()) return;
  const double along = turned.dot(omega);
  ratio_ += kGain * (std::min(along * along / expected, kMaxCorrection) - ratio_);
  if (ratio_ > kContradiction) {
    sigma_ = std::clamp(sigma_ * std::pow(ratio_, kGain), kMinJitter, kMaxJitter);
  } else if (ratio_ < 1.0) {
    sigma_ /= 1.04;
    if (sigma_ < kMinJitter) sigma_ = 0;
  }
}

bool StampMonitor::isGrowing() const { return ratio_ > kContradiction && sigma_ > 0 && sigma_ < kMaxJitter; }

void StampMonitor::reset() { *this = StampMonitor(adapt_); }

void ImuNoiseMonitor::add(double correction, int used, int gated) {
  if (!adapt_ || used + gated < 5 || !std::isfinite(correction)) return;
  gated_ratio_ += kGain * (static_cast<double>(gated) / (used + gated) - gated_ratio_);
  correction_ += kGain * (std::clamp(correction, 0.0, kMaxCorrection) - correction_);
  if (correction_ > kContradiction) {
    scale_ *= std::pow(correction_, kGain);
  } else if (gated_ratio_ > kManyGated) {
    scale_ *= 1.05;
  } else if (correction_ < 1.0 && gated_ratio_ < 0.5 * kManyGated) {
    scale_ /= 1.02;
  }
  scale_ = std::clamp(scale_, 1.0, kWidest);
}

void ImuNoiseMonitor::reset() { *this = ImuNoiseMonitor(adapt_); }

}  // namespace vip_slam
