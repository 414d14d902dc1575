#include "vip_slam_core/imu/imu_buffer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vip_slam {
namespace {

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

bool ImuBuffer::add(const ImuSample& sample) {
  if (!std::isfinite(sample.t) || !sample.gyro.allFinite() || !sample.accel.allFinite()) {
    ++counters_.not_finite;
    return false;
  }
  if (!samples_.empty()) {
    if (sample.t == samples_.back().t) {
      ++counters_.duplicate;
      return false;
    }
    if (sample.t < samples_.back().t) {
      ++counters_.out_of_order;
      return false;
    }
    if (sample.t - samples_.back().t > gap_seconds_) ++counters_.gaps;
  }
  samples_.push_back(sample);
  ++counters_.accepted;
  while (samples_.back().t - samples_.front().t > capacity_seconds_) samples_.pop_front();
  return true;
}

bool ImuBuffer::acceptStamped(std::deque<Stamped>* stream, double newest_joined, double t,
                              const Eigen::Vector3d& value) {
  if (!std::isfinite(t) || !value.allFinite()) {
    ++counters_.not_finite;
    return false;
  }
  const double newest = stream->empty() ? newest_joined : stream->back().t;
  if (t == newest) {
    ++counters_.duplicate;
    return false;
  }
  if (t < newest) {
    ++counters_.out_of_order;
    return false;
  }
  stream->push_back({t, value});
  // When the other stream never comes, memory must still be bounded.
  while (stream->back().t - stream->front().t > capacity_seconds_) stream->pop_front();
  return true;
}

bool ImuBuffer::addGyro(double t, const Eigen::Vector3d& gyro) {
  const double joined = samples_.empty() ? -std::numeric_limits<double>::infinity() : samples_.back().t;
  if (!acceptStamped(&gyro_, joined, t, gyro)) return false;
  joinStreams();
  return true;
}

bool ImuBuffer::addAccel(double t, const Eigen::Vector3d& accel) {
  if (!acceptStamped(&accel_, -std::numeric_limits<double>::infinity(), t, accel)) return false;
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
      if (span > gap_seconds_) {  // a line across a hole of the accelerometer is an invention: a gap shows as one
        gyro_.pop_front();
        continue;
      }
      const double s = (gyro.t - accel_[0].t) / span;
      sample.accel = (1.0 - s) * accel_[0].value + s * accel_[1].value;
    }
    gyro_.pop_front();
    add(sample);
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
  if (!(t1 > t0) || !covers(t0) || !covers(t1)) return {};
  const auto begin = std::lower_bound(samples_.begin(), samples_.end(), t0, earlier);
  const auto end = std::lower_bound(begin, samples_.end(), t1, earlier);
  std::vector<ImuSample> result;
  result.reserve(static_cast<std::size_t>(end - begin) + 2);
  if (begin->t > t0) result.push_back(interpolate(*std::prev(begin), *begin, t0));
  result.insert(result.end(), begin, end);
  result.push_back(end->t == t1 ? *end : interpolate(*std::prev(end), *end, t1));
  if (max_gap) {
    // Between the buffered samples themselves: interpolating the ends inside a gap must not hide it.
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
}

}  // namespace vip_slam
