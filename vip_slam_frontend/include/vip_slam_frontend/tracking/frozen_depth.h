// SPDX-License-Identifier: BSD-3-Clause
// Detects a frozen depth camera, which repeats its last image under new stamps.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace vip_slam {

/// Between the readings that stand for a depth image as a whole, px.
constexpr int kReadingStep = 12;

class FrozenDepth {
 public:
  /// Whether this image equals the one before, by a sample of its pixels. False for an image with hardly any depth,
  /// which may repeat by chance.
  bool repeats(const cv::Mat& depth);
  void clear() { last_.clear(); }

 private:
  std::vector<float> last_;
};

}  // namespace vip_slam
