// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/noise_monitor.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

// Largest factor on the IMU's noise; limits the influence of a single image as well.
constexpr double kWidest = 30.0;

/// Per image, of the moving averages.
double gain() { return 1.0 / kEnough; }

/// So many sigmas above 1 for the moving average of a consistent correction with six degrees of freedom.
double contradiction() { return 1.0 + kGateSigmas * std::sqrt(2.0 / 6.0 * gain() / (2.0 - gain())); }

}  // namespace

void NoiseMonitor::add(double chi2_per_dof, int dof) {
  if (dof < kEnough || !(chi2_per_dof > 0) || !std::isfinite(chi2_per_dof)) return;
  // A plain average at first: a wrong initial value is forgotten quickly.
  const double share = 1.0 / (updates_ = std::min(updates_ + 1, kEnough));
  sigma_ = std::clamp(sigma_ * std::exp(share * 0.5 * std::log(chi2_per_dof)), min_, max_);
}

void ImuNoiseMonitor::add(double correction, int features) {
  if (!adapt_ || features < 5 || !std::isfinite(correction)) return;
  correction_ += gain() * (std::clamp(correction, 0.0, kWidest) - correction_);
  if (correction_ > contradiction() || correction_ < 1.0) {
    scale_ = std::clamp(scale_ * std::pow(correction_, gain()), 1.0, kWidest);
  }
}

void ImuNoiseMonitor::reset() { *this = ImuNoiseMonitor(adapt_); }

}  // namespace vip_slam
