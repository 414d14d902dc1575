// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/spike_filter.h"

#include <algorithm>
#include <limits>

#include "vip_slam_core/imu/imu_buffer.h"

namespace vip_slam {
namespace {

// Smallest size of a spike, absolute and relative to the usual difference of successive samples. With IMUs at 100 to
// 400 Hz in the hand or on a robot these are a few tenths of a m/s^2 and a few hundredths of a rad/s.
constexpr double kMinGyro = 0.5;   // rad/s
constexpr double kMinAccel = 3.0;  // m/s^2
constexpr double kMinRatio = 10.0;

// The samples before a spike, and those before and after it, must agree within this many usual differences (two steps
// of a motion). The usual differences are taken as at least these quiet levels.
constexpr double kAgreeRatio = 4.0;
constexpr double kQuietGyro = 0.02;  // rad/s
constexpr double kQuietAccel = 0.2;  // m/s^2

// Longest step between samples for a decision, s: across a longer one the motion itself may change by any amount.
constexpr double kLongestStep = 0.025;

}  // namespace

void SpikeFilter::Differences::add(double difference) { ring_[count_++ % kWindow] = difference; }

double SpikeFilter::Differences::usual() const {
  std::array<double, kWindow> sorted = ring_;
  const auto at = sorted.begin() + kWindow * 3 / 4 - 1;
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

double SpikeFilter::newest() const {
  if (suspect_) return suspect_->t;
  return last_ ? last_->t : -std::numeric_limits<double>::infinity();
}

void SpikeFilter::clear() {
  last_.reset();
  suspect_.reset();
  gyro_.clear();
  accel_.clear();
  calm_ = false;
}

bool SpikeFilter::agree(const ImuSample& a, const ImuSample& b) const {
  return b.t - a.t <= 2 * kLongestStep &&
         (b.gyro - a.gyro).norm() <= kAgreeRatio * std::max(kQuietGyro, gyro_.usual()) &&
         (b.accel - a.accel).norm() <= kAgreeRatio * std::max(kQuietAccel, accel_.usual());
}

bool SpikeFilter::suspicious(const ImuSample& sample) const {
  if (!calm_ || !gyro_.full() || sample.t - last_->t > kLongestStep) return false;
  const double gyro = (sample.gyro - last_->gyro).norm(), accel = (sample.accel - last_->accel).norm();
  return (gyro > kMinGyro && gyro > kMinRatio * gyro_.usual()) ||
         (accel > kMinAccel && accel > kMinRatio * accel_.usual());
}

void SpikeFilter::remember(const ImuSample& sample) {
  const bool near = last_ && sample.t - last_->t <= kLongestStep;
  calm_ = near && agree(*last_, sample);
  if (near) {
    gyro_.add((sample.gyro - last_->gyro).norm());
    accel_.add((sample.accel - last_->accel).norm());
  } else {
    gyro_.clear();
    accel_.clear();
  }
  last_ = sample;
}

std::vector<ImuSample> SpikeFilter::add(const ImuSample& sample) {
  std::vector<ImuSample> settled;
  if (suspect_) {
    const bool spike = sample.t - suspect_->t <= kLongestStep && agree(*last_, sample);
    settled.push_back(spike ? interpolate(*last_, sample, suspect_->t) : *suspect_);
    spikes_ += spike;
    remember(*suspect_);
    suspect_.reset();
    if (spike) {
      remember(sample);
      calm_ = true;  // the step back from a spike is not a motion
      settled.push_back(sample);
      return settled;
    }
  }
  if (suspicious(sample)) {
    suspect_ = sample;
    return settled;
  }
  remember(sample);
  settled.push_back(sample);
  return settled;
}

}  // namespace vip_slam
