// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/rate_history.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

namespace {

// Time that last() averages over, s.
constexpr double kMoment = 0.01;
// The rate changes clearly when its variance is this many times that of the noise. A delay estimated from noise alone
// was wrong by 10 ms at a sigma of 1 ms; at this limit it is off by two sigmas, well above by less than one
// (docs/notebook/depth_and_calibration.md).
constexpr double kClearly = 40.0;

Eigen::Vector3d mean(const std::vector<ImuSample>& samples) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : samples) sum += sample.gyro;
  return sum / static_cast<double>(samples.size());
}

/// Number of samples within the last kMoment seconds.
std::ptrdiff_t lastOnes(const std::vector<ImuSample>& samples) {
  const double since = samples.back().t - kMoment - 1e-4;
  return samples.end() -
         std::find_if(samples.begin(), samples.end(), [since](const ImuSample& s) { return s.t > since; });
}

}  // namespace

Eigen::Vector3d RateHistory::last(const std::vector<ImuSample>& samples) {
  return mean({samples.end() - lastOnes(samples), samples.end()});
}

void RateHistory::add(const std::vector<ImuSample>& samples) {
  const Eigen::Vector3d now = mean(samples);
  std::copy_backward(means_.begin(), means_.end() - 1, means_.end());
  means_[0] = now;
  const double share = 1.0 / kEnough;
  double variance = 0;
  if (noiseOf(samples, &variance)) noise_ += share * (variance / static_cast<double>(lastOnes(samples)) - noise_);
  if (++intervals_ < 3) return;
  squared_changes_ += share * ((now - means_[2]).squaredNorm() / 3.0 - squared_changes_);
}

// A sample's difference from the line through its neighbours is mostly noise. An interval may have only
// one or two samples between its interpolated ends, so these differences continue across intervals.
bool RateHistory::noiseOf(const std::vector<ImuSample>& samples, double* variance) {
  double squares = 0;
  int n = 0;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const ImuSample &a = measured_[0], &b = measured_[1], &c = samples[i];
    if (measured_count_ >= 2 && a.t < b.t && b.t < c.t) {
      const double of_c = (b.t - a.t) / (c.t - a.t), of_a = 1.0 - of_c;
      squares += (b.gyro - of_a * a.gyro - of_c * c.gyro).squaredNorm() / (1.0 + of_a * of_a + of_c * of_c);
      n += 3;
    }
    measured_ = {b, c};
    ++measured_count_;
  }
  if (n > 0) *variance = squares / n;
  return n > 0;
}

Eigen::Vector3d RateHistory::expected(const std::vector<ImuSample>& samples) const {
  return intervals_ < 3 ? mean(samples) : Eigen::Vector3d(means_[0] + 0.5 * (means_[0] - means_[2]));
}

bool RateHistory::changes() const { return squared_changes_ > kClearly * noise_; }

}  // namespace vip_slam
