// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/image_pairer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace vip_slam {
namespace {
constexpr std::size_t kIntervals = 10;      // colour intervals remembered, of which the shortest ignores lost images
constexpr std::size_t kLags = 9;            // pairs of which the lag is remembered
constexpr double kShortestInterval = 0.01;  // seconds; assumed until one is known

void remember(double value, std::size_t count, std::deque<double>* last) {
  last->push_back(value);
  if (last->size() > count) last->pop_front();
}

double shortest(const std::deque<double>& intervals) {
  const auto least = std::min_element(intervals.begin(), intervals.end());
  return least == intervals.end() ? kShortestInterval : *least;
}

}  // namespace

bool mostlyUnpaired(const PairerCounters& before, const PairerCounters& now) {
  constexpr std::size_t kEnough = 10;  // images
  const std::size_t alone = now.without_depth - before.without_depth;
  return alone > kEnough && alone > now.pairs - before.pairs;
}

bool ImagePairer::addColor(double t, cv::Mat gray, std::uint64_t stamp) {
  if (!std::isfinite(t) || (newest_color_ && t <= *newest_color_)) {
    ++counters_.backward;
    return false;
  }
  if (newest_color_) remember(t - *newest_color_, kIntervals, &color_intervals_);
  newest_color_ = t;
  color_.push_back({t, std::move(gray), stamp});
  if (color_.size() > options_.capacity) {
    popColor();
    ++counters_.dropped;
  }
  return true;
}

bool ImagePairer::addDepth(double t, cv::Mat depth) {
  if (!std::isfinite(t) || (newest_depth_ && t <= *newest_depth_)) {
    ++counters_.backward;
    return false;
  }
  if (newest_depth_) remember(t - *newest_depth_, kIntervals, &depth_intervals_);
  newest_depth_ = t;
  depth_.push_back({t, std::move(depth), 0});
  if (depth_.size() > options_.capacity) {
    depth_.pop_front();
    ++counters_.unused_depth;
  }
  return true;
}

double ImagePairer::newest() const { return std::max(newest_color_.value_or(-1e300), newest_depth_.value_or(-1e300)); }

void ImagePairer::popColor() {
  previous_color_ = color_.front().t;
  color_.pop_front();
}

double ImagePairer::usualLag() const {
  constexpr std::size_t kEnough = 5;  // pairs
  constexpr double kSteady = 0.5;     // of the interval; streams of different rates come with every lag in turn
  constexpr double kFarthest = 0.7;   // of the interval; beyond, the neighbour is clearly the better partner
  if (lags_.size() < kEnough) return 0;
  std::vector<double> sorted(lags_.begin(), lags_.end());
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2], interval = shortest(color_intervals_);
  const bool steady = sorted.back() - sorted.front() < kSteady * interval;
  return steady && std::abs(median) <= kFarthest * interval ? median : 0;
}

bool ImagePairer::belongsToFront(double t, double lag) const {
  const double distance = std::abs(t - lag - color_.front().t);
  if (previous_color_ && std::abs(t - lag - *previous_color_) < distance) return false;
  return color_.size() < 2 || distance <= std::abs(t - lag - color_[1].t);
}

const ImagePair* ImagePairer::front() {
  if (front_) return &*front_;
  if (color_.empty()) return nullptr;
  const double t = color_.front().t;
  while (!depth_.empty() && depth_.front().t < t - options_.tolerance) {
    depth_.pop_front();
    ++counters_.unused_depth;
  }
  const double lag = usualLag(), expected = t + lag;
  const auto usable = [&](const StampedImage& d) {
    return std::abs(d.t - t) <= options_.tolerance && belongsToFront(d.t, lag);
  };
  const auto after =
      std::find_if(depth_.begin(), depth_.end(), [expected](const StampedImage& d) { return d.t >= expected; });
  auto best = depth_.end();
  if (after != depth_.end() && usable(*after)) best = after;
  if (after != depth_.begin()) {
    const auto before = std::prev(after);
    if (usable(*before) && (best == depth_.end() || expected - before->t < best->t - expected)) best = before;
  }
  // The nearest depth image is known once one at or after the expected stamp has arrived, or one so little before that
  // the next cannot be nearer. A later one may belong to the next colour image, which has not arrived yet.
  constexpr double kSurelyNearer = 0.45;  // of the interval: less than half, since stamps jitter
  const bool next_depth_matters =
      after == depth_.end() &&
      (best == depth_.end() || expected - best->t > kSurelyNearer * shortest(depth_intervals_));
  const bool next_color_matters =
      best != depth_.end() && color_.size() < 2 && best->t - expected > kSurelyNearer * shortest(color_intervals_);
  const bool waits = next_depth_matters || next_color_matters;
  const bool decided = !waits || newest() - t > options_.patience || ended_;
  if (!decided) return nullptr;

  front_ = ImagePair{t, std::move(color_.front().image), {}, 0, color_.front().stamp};
  popColor();
  if (best == depth_.end()) {
    ++counters_.without_depth;
  } else {
    counters_.skew = front_->depth_lag = best->t - t;
    counters_.unused_depth += std::size_t(best - depth_.begin());
    remember(best->t - t, kLags, &lags_);
    front_->depth = std::move(best->image);
    depth_.erase(depth_.begin(), best + 1);
    ++counters_.pairs;
  }
  return &*front_;
}

void ImagePairer::pop() { front_.reset(); }

void ImagePairer::clear() {
  color_.clear();
  depth_.clear();
  color_intervals_.clear();
  depth_intervals_.clear();
  lags_.clear();
  previous_color_.reset();
  newest_color_.reset();
  newest_depth_.reset();
  front_.reset();
  ended_ = false;
}

}  // namespace vip_slam
