// SPDX-License-Identifier: BSD-3-Clause
// Pairs colour and depth images by their stamps. ROS-free, single owner; used by the nodelet and the offline runner, so
// that both get the same pairs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include <opencv2/core.hpp>

#include "vip_slam_ros/input_options.h"

namespace vip_slam {

struct StampedImage {
  double t = 0;  ///< seconds
  cv::Mat image;
  std::uint64_t stamp = 0;  ///< see ImagePair
};

struct ImagePair {
  double t = 0;  ///< stamp of gray
  cv::Mat gray;
  cv::Mat depth;            ///< empty: none arrived in time
  double depth_lag = 0;     ///< stamp of depth - stamp of gray, seconds
  std::uint64_t stamp = 0;  ///< of gray in nanoseconds, as given: exact, unlike the double t
};

struct PairerOptions {
  double tolerance = InputOptions().pair_tolerance;  ///< largest difference between the stamps of a pair, seconds
  double patience =
      InputOptions().depth_patience;  ///< colour waits for its depth until any image is this much newer, seconds
  std::size_t capacity = 20;
};

struct PairerCounters {
  std::size_t pairs = 0;
  std::size_t without_depth = 0;  ///< colour images that no depth matched
  std::size_t unused_depth = 0;
  std::size_t dropped = 0;   ///< colour images dropped from a full queue
  std::size_t backward = 0;  ///< images whose stamp was not newer than the one before
  double skew = 0;           ///< depth stamp - colour stamp of the newest pair, seconds
};

/// Whether most colour images between two counts had no depth: the streams are not synchronised.
bool mostlyUnpaired(const PairerCounters& before, const PairerCounters& now);

class ImagePairer {
 public:
  explicit ImagePairer(const PairerOptions& options = {}) : options_(options) {}

  /// Images of each stream must be in the order of their stamps; others are counted and refused (false).
  bool addColor(double t, cv::Mat gray, std::uint64_t stamp = 0);
  bool addDepth(double t, cv::Mat depth);

  /// The oldest colour image once its depth has arrived or can no longer arrive, with the depth of the nearest stamp,
  /// one to one and in order. A depth image is only paired with the colour image nearest to it. What may be nearer but
  /// has not arrived yet is waited for, unless the usual interval shows that it cannot be.
  /// "Near" is meant after the usual lag of depth behind colour is taken off: streams that are half an interval apart
  /// would otherwise change partners with the jitter of their stamps, and lose an image each time.
  const ImagePair* front();
  void pop();
  /// No more images will come: front() returns the waiting ones with the depth available.
  void end() { ended_ = true; }
  void clear();

  /// Stamp of the newest image of either stream.
  double newest() const;
  const PairerCounters& counters() const { return counters_; }

 private:
  void popColor();
  /// Whether a depth image at `t` is not nearer to another colour image than to the oldest waiting one.
  bool belongsToFront(double t, double lag) const;
  double usualLag() const;  ///< depth stamp - colour stamp of recent pairs, seconds; 0 when it is not steady

  PairerOptions options_;
  std::deque<StampedImage> color_, depth_;
  std::deque<double> color_intervals_, depth_intervals_;  ///< of the last images, seconds
  std::deque<double> lags_;                               ///< of the last pairs, seconds
  std::optional<double> previous_color_;                  ///< stamp of the colour image before the oldest waiting one
  std::optional<double> newest_color_, newest_depth_;
  std::optional<ImagePair> front_;
  bool ended_ = false;
  PairerCounters counters_;
};

}  // namespace vip_slam
