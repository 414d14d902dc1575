#include "vip_slam_frontend/filter/noise_monitor.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

namespace {

// What it begins with is a guess that may be off by this much (logarithm), and so many images may say so.
constexpr double kMostOfGuess = 3.0;
constexpr int kGuessed = 3;
constexpr double kGain = 0.05;            // per image, of the moving averages
constexpr double kMostCorrection = 20.0;  // one image may not decide
// Three sigmas above 1 for the moving average of six honest degrees of freedom.
constexpr double kContradiction = 1.3;
constexpr double kManyGated = 0.3;
constexpr double kWidest = 30.0;

}  // namespace

NoiseMonitor::NoiseMonitor(double sigma, double lowest, double highest, bool adapt)
    : sigma_(std::clamp(sigma, lowest, std::max(lowest, highest))), min_(lowest), max_(highest), adapt_(adapt) {}

void NoiseMonitor::add(double chi2_per_dof, int dof) {
  if (!adapt_ || dof < 20 || !(chi2_per_dof > 0) || !std::isfinite(chi2_per_dof)) return;
  // The first images count as much as those after them, so that a wrong start is soon forgotten.
  const double gain = 1.0 / (updates_ = std::min(updates_ + 1, 20));
  const double most = updates_ <= kGuessed ? kMostOfGuess : 1.0;
  const double step = gain * std::clamp(0.5 * std::log(chi2_per_dof), -most, most);
  sigma_ = std::clamp(sigma_ * std::exp(step), min_, std::max(min_, max_));
}

void ImuNoiseMonitor::add(double correction, int used, int gated) {
  if (!adapt_ || used + gated < 5 || !std::isfinite(correction)) return;
  gated_ratio_ += kGain * (static_cast<double>(gated) / (used + gated) - gated_ratio_);
  correction_ += kGain * (std::clamp(correction, 0.0, kMostCorrection) - correction_);
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
