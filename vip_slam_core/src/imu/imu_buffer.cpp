// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/imu/imu_buffer.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {
namespace {

// Shortest interval, s: below, within the rounding of stamps, there is nothing to integrate.
constexpr double kShortest = 1e-6;

bool earlier(const ImuSample& sample, double t) { return sample.t < t; }

}  // namespace

ImuSample interpolate(const ImuSample& a, const ImuSample& b, double t) {
  const double span = b.t - a.t;
  const double s = span > 0 ? (t - a.t) / span : 0.0;
  ImuSample sample;
  sample.t = t;
  sample.gyro = (1.0 - s) * a.gyro + s * b.gyro;
  sample.accel = (1.0 - s) * a.accel + s * b.accel;
  return sample;
}

ImuBuffer::ImuBuffer(double gap_seconds, double capacity_seconds)
    : gap_seconds_(gap_seconds), capacity_seconds_(capacity_seconds) {}

bool ImuBuffer::acceptable(double t, bool finite, const SpikeFilter& stream) {
  if (!std::isfinite(t) || !finite) {
    ++counters_.not_finite;
    return false;
  }
  if (t == stream.newest()) {
    ++counters_.duplicate;
    return false;
  }
  if (t < stream.newest()) {
    ++counters_.out_of_order;
    return false;
  }
  return true;
}

void ImuBuffer::countReplaced() {
  counters_.spikes = united_.spikes() + gyro_stream_.spikes() + accel_stream_.spikes();
}

bool ImuBuffer::add(const ImuSample& sample) {
  // A failing bus delivers zeros; no sensor measures exactly zero on all axes.
  const bool silent = sample.gyro.isZero(0) && sample.accel.isZero(0);
  const bool finite = sample.gyro.allFinite() && sample.accel.allFinite() && !silent;
  if (!acceptable(sample.t, finite, united_)) return false;
  ++counters_.accepted;
  for (const ImuSample& settled : united_.add(sample)) append(settled);
  countReplaced();
  return true;
}

void ImuBuffer::append(const ImuSample& sample) {
  if (!samples_.empty() && sample.t - samples_.back().t > gap_seconds_) ++counters_.gaps;
  samples_.push_back(sample);
  while (samples_.back().t - samples_.front().t > capacity_seconds_) samples_.pop_front();
}

bool ImuBuffer::addGyro(double t, const Eigen::Vector3d& gyro) {
  // With an empty buffer an earlier stamp is not out of order.
  if (samples_.empty() && gyro_.empty() && t < gyro_stream_.newest()) gyro_stream_.clear();
  if (!acceptable(t, gyro.allFinite(), gyro_stream_)) return false;
  for (const ImuSample& settled : gyro_stream_.add({t, gyro, Eigen::Vector3d::Zero()})) {
    gyro_.push_back({settled.t, settled.gyro});
  }
  // Bounds memory when the other stream never arrives.
  while (!gyro_.empty() && gyro_.back().t - gyro_.front().t > capacity_seconds_) gyro_.pop_front();
  countReplaced();
  joinStreams();
  return true;
}

bool ImuBuffer::addAccel(double t, const Eigen::Vector3d& accel) {
  if (!acceptable(t, accel.allFinite() && !accel.isZero(0), accel_stream_)) return false;
  for (const ImuSample& settled : accel_stream_.add({t, Eigen::Vector3d::Zero(), accel})) {
    accel_.push_back({settled.t, settled.accel});
  }
  while (!accel_.empty() && accel_.back().t - accel_.front().t > capacity_seconds_) accel_.pop_front();
  countReplaced();
  joinStreams();
  return true;
}

void ImuBuffer::joinStreams() {
  while (!gyro_.empty() && !accel_.empty()) {
    const Stamped& gyro = gyro_.front();
    if (gyro.t > accel_.back().t) return;
    if (gyro.t < accel_.front().t) {  // older than any accelerometer sample: nothing to interpolate from
      gyro_.pop_front();
      continue;
    }
    while (accel_.size() > 1 && accel_[1].t <= gyro.t) accel_.pop_front();
    ImuSample sample;
    sample.t = gyro.t;
    sample.gyro = gyro.value;
    sample.accel = accel_[0].value;
    if (accel_[0].t < gyro.t) {
      const double span = accel_[1].t - accel_[0].t;
      if (span > gap_seconds_) {  // do not interpolate across an accelerometer gap: it must remain visible as a gap
        gyro_.pop_front();
        continue;
      }
      const double s = (gyro.t - accel_[0].t) / span;
      sample.accel = (1.0 - s) * accel_[0].value + s * accel_[1].value;
    }
    gyro_.pop_front();
    ++counters_.accepted;
    append(sample);
  }
}

std::optional<ImuSample> ImuBuffer::at(double t) const {
  if (!covers(t)) return std::nullopt;
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t, earlier);
  if (after->t == t) return *after;
  return interpolate(*std::prev(after), *after, t);
}

std::vector<ImuSample> ImuBuffer::between(double t0, double t1, double* max_gap) const {
  if (max_gap) *max_gap = 0;
  if (!(t1 - t0 > kShortest) || !covers(t0) || !covers(t1)) return {};
  const auto begin = std::lower_bound(samples_.begin(), samples_.end(), t0, earlier);
  const auto end = std::lower_bound(begin, samples_.end(), t1, earlier);
  std::vector<ImuSample> result;
  result.reserve(static_cast<std::size_t>(end - begin) + 2);
  if (begin->t > t0) result.push_back(interpolate(*std::prev(begin), *begin, t0));
  result.insert(result.end(), begin, end);
  result.push_back(end->t == t1 ? *end : interpolate(*std::prev(end), *end, t1));
  if (max_gap) {
    // Steps between the buffered samples themselves, since interpolated ends inside a gap would hide it.
    auto previous = begin->t > t0 ? std::prev(begin) : begin;
    for (auto it = std::next(previous); it != samples_.end(); previous = it++) {
      *max_gap = std::max(*max_gap, it->t - previous->t);
      if (it->t >= t1) break;
    }
  }
  return result;
}

void ImuBuffer::dropBefore(double t) {
  while (samples_.size() > 1 && samples_[1].t <= t) samples_.pop_front();
}

void ImuBuffer::clear() {
  samples_.clear();
  gyro_.clear();
  accel_.clear();
  united_.clear();
  gyro_stream_.clear();
  accel_stream_.clear();
}

}  // namespace vip_slam
