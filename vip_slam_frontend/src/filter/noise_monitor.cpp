#include "vip_slam_frontend/filter/noise_monitor.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

NoiseMonitor::NoiseMonitor(double sigma_px, double min_px, double max_px, bool adapt)
    : sigma_(std::clamp(sigma_px, min_px, std::max(min_px, max_px))), min_(min_px), max_(max_px), adapt_(adapt) {}

void NoiseMonitor::add(double chi2_per_dof, int dof) {
  if (!adapt_ || dof < 20 || !(chi2_per_dof > 0) || !std::isfinite(chi2_per_dof)) return;
  // The first images count as much as those after them, so that a wrong start is soon forgotten.
  const double gain = 1.0 / (updates_ = std::min(updates_ + 1, 20));
  const double step = gain * std::clamp(0.5 * std::log(chi2_per_dof), -1.0, 1.0);
  sigma_ = std::clamp(sigma_ * std::exp(step), min_, std::max(min_, max_));
}

void ImuNoiseMonitor::add(int used, int gated) {
  if (!adapt_ || used + gated < 5) return;
  gated_ratio_ += 0.05 * (static_cast<double>(gated) / (used + gated) - gated_ratio_);
  if (gated_ratio_ > 0.3) {
    scale_ = std::min(10.0, scale_ * 1.05);
  } else if (gated_ratio_ < 0.15) {
    scale_ = std::max(1.0, scale_ / 1.02);
  }
}

void ImuNoiseMonitor::reset() {
  scale_ = 1.0;
  gated_ratio_ = 0.05;
}

}  // namespace vip_slam
