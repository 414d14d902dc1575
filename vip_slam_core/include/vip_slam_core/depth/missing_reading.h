// SPDX-License-Identifier: BSD-3-Clause
// Depth cameras that write "no reading" as a distance, as the end of their range, instead of 0.
#pragma once

#include <opencv2/core.hpp>

namespace vip_slam {

/// Many pixels of an image have exactly one value, and nowhere does it pass into a neighbouring one: at the border of
/// each patch the surface beside it is at another distance. No surface looks like that for several images, however
/// coarse the readings are.
class MissingReading {
 public:
  /// Looks at a depth image (32FC1, m, 0 = invalid).
  void look(const cv::Mat& depth);

  /// The value that stands for "no reading", m; 0: none.
  float value() const { return images_ >= kImages ? candidate_ : 0; }

 private:
  static constexpr int kImages = 3;  // in a row, so that a board that stands free does not pass for it
  float candidate_ = 0;
  int images_ = 0;
};

}  // namespace vip_slam
