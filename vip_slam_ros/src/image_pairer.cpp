#include "vip_slam_ros/image_pairer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vip_slam {
namespace {
constexpr std::size_t kIntervals = 10;      // colour intervals remembered, of which the shortest ignores lost images
constexpr double kShortestInterval = 0.01;  // seconds; assumed until one is known
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
  if (newest_color_) color_intervals_.push_back(t - *newest_color_);
  if (color_intervals_.size() > kIntervals) color_intervals_.pop_front();
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

double ImagePairer::colorInterval() const {
  const auto shortest = std::min_element(color_intervals_.begin(), color_intervals_.end());
  return shortest == color_intervals_.end() ? kShortestInterval : *shortest;
}

bool ImagePairer::belongsToFront(double t) const {
  const double distance = std::abs(t - color_.front().t);
  if (previous_color_ && std::abs(t - *previous_color_) < distance) return false;
  return color_.size() < 2 || distance <= std::abs(t - color_[1].t);
}

const ImagePair* ImagePairer::front() {
  if (front_) return &*front_;
  if (color_.empty()) return nullptr;
  const double t = color_.front().t;
  while (!depth_.empty() && depth_.front().t < t - options_.tolerance) {
    depth_.pop_front();
    ++counters_.unused_depth;
  }
  // The nearest depth image is known once one at or after t has arrived; an exact match needs no waiting.
  const auto after = std::find_if(depth_.begin(), depth_.end(), [t](const StampedImage& d) { return d.t >= t; });
  auto best = depth_.end();
  if (after != depth_.end() && after->t <= t + options_.tolerance && belongsToFront(after->t)) best = after;
  if (after != depth_.begin()) {
    const auto before = std::prev(after);
    if (belongsToFront(before->t) && (best == depth_.end() || t - before->t < best->t - t)) best = before;
  }
  // A newer depth image may belong to the next colour image, which has not arrived yet.
  constexpr double kSurelyNearer = 0.45;  // of the interval: less than half, since stamps jitter
  const bool next_matters = best != depth_.end() && color_.size() < 2 && best->t - t > kSurelyNearer * colorInterval();
  const bool decided = (after != depth_.end() && !next_matters) || newest() - t > options_.patience || ended_;
  if (!decided) return nullptr;

  front_ = ImagePair{t, std::move(color_.front().image), {}, 0, color_.front().stamp};
  popColor();
  if (best == depth_.end()) {
    ++counters_.without_depth;
  } else {
    counters_.skew = front_->depth_lag = best->t - t;
    counters_.unused_depth += std::size_t(best - depth_.begin());
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
  previous_color_.reset();
  newest_color_.reset();
  newest_depth_.reset();
  front_.reset();
  ended_ = false;
}

}  // namespace vip_slam
