// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/inertial/inertial_input.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vip_slam_core/imu/gyro_correction.h"

namespace vip_slam::frontend {

namespace {

constexpr double kCapacity = 30.0;  // s
constexpr double kGrid = 0.005;     // s, between samples where there is no complete IMU

}  // namespace

InertialInput::InertialInput(const SensorConfig& sensor, double max_gap)
    : has_gyro_(sensor.hasGyro()),
      has_accel_(sensor.hasAccel()),
      gyro_density_(sensor.imu_noise.gyro_noise_density),
      accel_density_(sensor.imu_noise.accel_noise_density),
      gyro_correction_(sensor.gyro_correction),
      gravity_(sensor.gravity),
      buffer_(max_gap, kCapacity) {}

bool InertialInput::addImu(const ImuSample& sample) {
  const bool accepted = buffer_.add({sample.t, correctedRate(sample.gyro, gyro_correction_), sample.accel});
  if (accepted) range_.add(sample.t, sample.gyro);
  return accepted;
}

bool InertialInput::addGyro(double t, const Eigen::Vector3d& gyro) {
  if (has_accel_) {
    const bool accepted = buffer_.addGyro(t, correctedRate(gyro, gyro_correction_));
    if (accepted) range_.add(t, gyro);
    return accepted;
  }
  if (!std::isfinite(t) || !gyro.allFinite() || (!lone_.empty() && t <= lone_.back().t)) return false;
  lone_.push_back({t, correctedRate(gyro, gyro_correction_)});
  range_.add(t, gyro);
  return true;
}

bool InertialInput::addAccel(double t, const Eigen::Vector3d& accel) {
  if (has_gyro_) return buffer_.addAccel(t, accel);
  if (!std::isfinite(t) || !accel.allFinite() || accel.isZero() || (!lone_.empty() && t <= lone_.back().t))
    return false;
  lone_.push_back({t, accel});
  return true;
}

double InertialInput::oldest() const {
  if (complete()) return buffer_.empty() ? std::numeric_limits<double>::infinity() : buffer_.oldest();
  return -std::numeric_limits<double>::infinity();  // what is missing is substituted
}

double InertialInput::newest() const {
  if (complete()) return buffer_.empty() ? -std::numeric_limits<double>::infinity() : buffer_.newest();
  return std::numeric_limits<double>::infinity();
}

double InertialInput::newestMeasured() const {
  if (complete()) return newest();
  return lone_.empty() ? -std::numeric_limits<double>::infinity() : lone_.back().t;
}

bool InertialInput::covers(double t) const {
  if (complete()) return buffer_.covers(t);
  return (!has_gyro_ && !has_accel_) || (!lone_.empty() && t <= lone_.back().t);
}

Eigen::Vector3d InertialInput::lone(double t) const {
  const auto after = std::lower_bound(lone_.begin(), lone_.end(), t, [](const Single& s, double x) { return s.t < x; });
  if (after == lone_.begin()) return after->value;
  if (after == lone_.end()) return lone_.back().value;
  const Single& before = *std::prev(after);
  return before.value + (t - before.t) / (after->t - before.t) * (after->value - before.value);
}

std::vector<ImuSample> InertialInput::measuredBetween(double t0, double t1, double* max_gap) const {
  std::vector<ImuSample> samples;
  if (max_gap) *max_gap = 0;
  if (complete()) {
    // The IMU may have ended: what comes after it is substituted.
    const bool bridged = !substitutes_.empty() && substitutes_.back().to >= t1 && !buffer_.empty() && t1 > newest();
    if (!bridged) return buffer_.between(t0, t1, max_gap);
    if (newest() > t0) samples = buffer_.between(t0, newest(), max_gap);
    if (!samples.empty()) t0 = samples.back().t;
  }
  if (!(t1 > t0)) return samples;
  const int steps = std::max(1, static_cast<int>(std::ceil((t1 - t0) / kGrid - 1e-6)));
  for (int i = samples.empty() ? 0 : 1; i <= steps; ++i) {
    ImuSample sample;
    sample.t = i == steps ? t1 : t0 + i * (t1 - t0) / steps;
    // Before the first substitute: at rest, level.
    sample.accel = Eigen::Vector3d(0, 0, gravity_);
    if (!substitutes_.empty()) {
      const Substitute& nearest = sample.t < substitutes_.back().from ? substitutes_.front() : substitutes_.back();
      if (nearest.gyro) sample.gyro = *nearest.gyro;
      if (nearest.accel) sample.accel = *nearest.accel;
    }
    if (!lone_.empty()) (has_gyro_ ? sample.gyro : sample.accel) = lone(sample.t);
    samples.push_back(sample);
  }
  return samples;
}

std::vector<ImuSample> InertialInput::between(double t0, double t1, double* max_gap) const {
  std::vector<ImuSample> samples = measuredBetween(t0, t1, max_gap);
  for (const Substitute& s : substitutes_) {
    if (s.to <= t0 || s.from >= t1) continue;
    for (ImuSample& sample : samples) {
      if (sample.t < s.from || sample.t > s.to) continue;
      if (s.gyro) sample.gyro = *s.gyro;
      if (s.accel) sample.accel = *s.accel;
    }
  }
  return samples;
}

std::optional<ImuSample> InertialInput::at(double t) const {
  if (complete()) return buffer_.at(t);
  const std::vector<ImuSample> around = between(t - kGrid, t);
  if (around.empty()) return std::nullopt;
  return around.back();
}

void InertialInput::substitute(const Substitute& substitute) {
  if (!(substitute.to > substitute.from)) return;
  substitutes_.push_back(substitute);
}

ChannelNoise InertialInput::noise(double t0, double t1) const {
  ChannelNoise noise;
  // White noise with the low frequencies of the motion that a stand-in leaves unknown.
  const double root = std::sqrt(2.0 / kBodyFrequency);
  const double turn = std::max(1.0, root * kBodyRate / gyro_density_),
               force = std::max(1.0, root * kBodyAcceleration / accel_density_);
  if (!has_gyro_) noise.gyro = turn;
  if (!has_accel_) noise.accel = force;
  for (const Substitute& s : substitutes_) {
    if (s.to <= t0 || s.from >= t1) continue;
    if (s.gyro) noise.gyro = turn;
    if (s.accel) noise.accel = force;
  }
  return noise;
}

bool InertialInput::measured(double t0, double t1) const {
  if (!complete()) return false;
  return std::none_of(substitutes_.begin(), substitutes_.end(),
                      [&](const Substitute& s) { return s.to > t0 && s.from < t1; });
}

void InertialInput::dropBefore(double t) {
  buffer_.dropBefore(t);
  while (lone_.size() > 1 && lone_[1].t < t) lone_.pop_front();
  while (substitutes_.size() > 1 && substitutes_.front().to < t) substitutes_.pop_front();
}

void InertialInput::clear() {
  buffer_.clear();
  lone_.clear();
  substitutes_.clear();
  range_.forgetTimes();
}

}  // namespace vip_slam::frontend
