// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/auto_exposure.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

constexpr double kTarget = 0.2;           ///< mean of the image, linear, 1 = white
constexpr double kControlSeconds = 0.33;  ///< to 1/e of the way to it
constexpr double kDeadBand = 0.08;        ///< differences by less than this share are left alone
constexpr double kShortest = 0.05;        ///< of the longest exposure time
constexpr double kMostGain = 16;

}  // namespace

AutoExposure::AutoExposure(const std::vector<double>& brightness, double exposure, double longest)
    : exposure_(exposure), longest_(longest) {
  double log_gain = 0, measured = 0;
  for (std::size_t k = 0; k < brightness.size(); ++k) {
    const double wanted = std::log(kTarget / std::max(brightness[k], 1e-6));
    if (k == 0) log_gain = measured = wanted;
    const double error = measured - log_gain;  // of the step before: measuring takes an image or two
    if (std::abs(error) > kDeadBand) log_gain += (1 - std::exp(-kStep / kControlSeconds)) * error;
    log_gain = std::clamp(log_gain, std::log(exposure_ * kShortest), std::log(exposure_ * kMostGain));
    gain_.push_back(std::exp(log_gain));
    measured = wanted;
  }
  if (gain_.empty()) gain_.push_back(exposure_);
}

Exposure AutoExposure::at(double t) const {
  const double f = std::clamp(t / kStep, 0.0, static_cast<double>(gain_.size() - 1));
  const auto i = static_cast<std::size_t>(f), next = std::min(i + 1, gain_.size() - 1);
  Exposure e;
  e.gain = gain_[i] + (gain_[next] - gain_[i]) * (f - static_cast<double>(i));
  const double analog = std::max(1.0, e.gain / exposure_);
  e.noise = std::sqrt(analog);
  e.time = longest_ * std::min(1.0, e.gain / exposure_);
  return e;
}

}  // namespace vip_slam
