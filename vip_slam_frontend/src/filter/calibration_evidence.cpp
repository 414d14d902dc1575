// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/calibration_evidence.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vip_slam::frontend {
namespace {

// The filter holds the number with this share of its prior's sigma: with all of it, the innovation gates let more
// outliers in (a phone, real: odometry 1.94 instead of 1.62 cm). What a step says of the number is the same.
constexpr double kHeld = 0.25;
constexpr double kStretch = 2.0;    // s, longer than a track lives: stretches share no measurements
constexpr double kOfScatter = 1;    // stretches that kUsualScatter is worth
constexpr std::size_t kEnough = 2;  // stretches, one may be the start's error
constexpr double kSure = 4.0;       // sigmas between the adopted value and the estimate
// Beyond so many sigmas of the prior something else is wrong, a unit or another sensor, and nothing is adopted.
constexpr double kBelievable = 4.0;
constexpr double kMuchSurer = 2.0;  // in information

}  // namespace

Likelihood learntBetween(const Estimate& before, const Estimate& after) {
  const double old = 1 / (before.sigma * before.sigma), now = 1 / (after.sigma * after.sigma);
  return {now - old, now * after.value - old * before.value};
}

Estimate CalibrationEvidence::held() const {
  const Estimate found = estimate();
  return {adopted_, std::min(kHeld * prior_.sigma, std::hypot(found.sigma, found.value - adopted_))};
}

void CalibrationEvidence::add(double t, const Likelihood& step) {
  // A filter that has failed says nothing; it is started again.
  if (!std::isfinite(step.information) || !std::isfinite(step.weighted)) return;
  if (stretches_.empty() || !(std::abs(t - begin_) < kStretch)) {
    stretches_.emplace_back();
    begin_ = t;
  }
  stretches_.back().add(step);
}

Estimate CalibrationEvidence::estimate() const {
  const double prior = 1 / (prior_.sigma * prior_.sigma);
  Likelihood sum;
  for (const Likelihood& stretch : stretches_) sum.add(stretch);
  if (!(sum.information > 0)) return prior_;
  const double mean = sum.weighted / sum.information;
  double squares = kUsualScatter * kOfScatter;
  for (const Likelihood& stretch : stretches_) {
    if (stretch.information > 0)
      squares += stretch.information * std::pow(stretch.weighted / stretch.information - mean, 2);
  }
  const double degrees = kOfScatter + static_cast<double>(stretches_.size() - 1);
  const double information = sum.information / std::max(1.0, squares / degrees);
  return {(information * mean + prior * prior_.value) / (information + prior), 1 / std::sqrt(information + prior)};
}

bool CalibrationEvidence::contradicts() const {
  if (stretches_.size() < kEnough) return false;
  const Estimate found = estimate();
  return std::abs(found.value - prior_.value) > std::max(kBelievable * prior_.sigma, kSure * found.sigma);
}

bool CalibrationEvidence::adopt() {
  if (stretches_.size() < kEnough) return false;
  const Estimate found = estimate();
  if (!(std::abs(found.value - prior_.value) < kBelievable * prior_.sigma)) {
    adopted_information_ = 0;
    return std::exchange(adopted_, prior_.value) != prior_.value;
  }
  const double information = 1 / (found.sigma * found.sigma), apart = std::abs(found.value - adopted_);
  const bool surer = adopted_information_ > 0 && information > kMuchSurer * adopted_information_;
  if (!(apart > kSure * found.sigma) && !(surer && apart > found.sigma)) return false;
  adopted_ = found.value;
  adopted_information_ = information;
  return true;
}

}  // namespace vip_slam::frontend
