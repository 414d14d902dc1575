// SPDX-License-Identifier: BSD-3-Clause
// What the IMU measures while the images stand still: an engine or fans shake it by more than its noise figures say.
#include <cmath>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kStandingFlow = 0.3;   // px, median of the corners between two images
constexpr double kLongEnough = 1.0;     // s of standing in all
constexpr double kShakes = 0.3;         // m/s^2, one sigma of an axis
constexpr double kAboveFigures = 10.0;  // times the noise density of the sensor file

struct Interval {
  double from, to;
};

/// Stretches in which successive images show the same.
std::vector<Interval> standing(const std::vector<PixelStep>& steps) {
  std::vector<Interval> out;
  for (const PixelStep& step : steps) {
    std::vector<float> flow;
    for (const PixelTrack& track : step.tracks) flow.push_back((track.to - track.from).norm());
    if (flow.empty() || upperMedian(flow) > kStandingFlow) continue;
    if (!out.empty() && out.back().to == step.t0)
      out.back().to = step.t1;
    else
      out.push_back({step.t0, step.t1});
  }
  return out;
}

struct Noise {
  double sigma = 0, density = 0;  ///< of one axis; unit and unit / sqrt(Hz)
};

/// Scatter about the mean of each half second, so that a bias or a slow sway does not count.
Noise noiseOf(const std::vector<StampedVector>& samples, const std::vector<Interval>& where) {
  constexpr double kBlock = 0.5;
  double squares = 0, degrees = 0, seconds = 0, count = 0;
  auto at = samples.begin();
  for (const Interval& interval : where) {
    for (double begin = interval.from; begin + kBlock <= interval.to; begin += kBlock) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero(), sum2 = sum;
      double n = 0;
      while (at != samples.end() && at->t < begin) ++at;
      for (; at != samples.end() && at->t < begin + kBlock; ++at) {
        if (!at->value.allFinite()) continue;
        sum += at->value;
        sum2 += at->value.cwiseAbs2();
        n += 1;
      }
      if (n < 5) continue;
      squares += (sum2 - sum.cwiseAbs2() / n).sum();
      degrees += 3 * (n - 1);
      count += n;
      seconds += kBlock;
    }
  }
  if (seconds < kLongEnough) return {};
  const double sigma = std::sqrt(std::max(0.0, squares / degrees));
  return {sigma, sigma / std::sqrt(count / seconds)};
}

}  // namespace

Findings checkShaking(const Recording& r) {
  const std::vector<Interval> where = standing(r.pixel_steps);
  const Noise accel = noiseOf(r.accel_samples, where), gyro = noiseOf(r.gyro_samples, where);
  const ImuNoise& figures = r.sensor.imu_noise;
  if (accel.sigma < kShakes || accel.density < kAboveFigures * figures.accel_noise_density) return {};
  return {{Severity::kError, "IMU",
           formatted("shakes by %.2f m/s^2 and %.3f rad/s (one sigma) while the images stand still: an engine, fans?",
                     accel.sigma, gyro.sigma),
           formatted("mount it softly; or set imu/accel_noise_density: %.2g (it says %.2g) and "
                     "imu/gyro_noise_density: %.2g (%.2g) in the sensor file",
                     accel.density, figures.accel_noise_density, gyro.density, figures.gyro_noise_density)}};
}

}  // namespace vip_slam
