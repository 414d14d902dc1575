#include "vip_slam_core/imu/stamp_filter.h"

#include <cmath>

namespace vip_slam {
namespace {

constexpr double kUsual = 2.0;  // a step of less than this many times the one before is none that a gap makes

}  // namespace

void StampFilter::decide(const ImuSample& sample, std::vector<ImuSample>* decided) {
  step_ = sample.t - newest_;  // infinite for the first
  newest_ = sample.t;
  decided->push_back(sample);
}

std::vector<ImuSample> StampFilter::add(const ImuSample& sample) {
  std::vector<ImuSample> decided;
  if (waits_ && sample.t < waits_->t) {
    ++dropped_;
  } else if (waits_) {
    decide(*waits_, &decided);
  }
  waits_.reset();
  const double step = sample.t - newest_;
  // A stream that is slower than the gap must not wait all the time.
  const bool usual = std::isfinite(step_) && step < kUsual * step_;
  if (!usual &&
      step > gap_seconds_) {  // infinite for the first of a stream, which only the second tells right or wrong
    waits_ = sample;
  } else {
    decide(sample, &decided);
  }
  return decided;
}

void StampFilter::clear() {
  newest_ = -std::numeric_limits<double>::infinity();
  step_ = std::numeric_limits<double>::infinity();
  waits_.reset();
}

}  // namespace vip_slam
