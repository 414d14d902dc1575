// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/frozen_depth.h"

#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam {

bool FrozenDepth::repeats(const cv::Mat& depth) {
  std::vector<float> now;
  int with_depth = 0;
  for (int y = kReadingStep / 2; y < depth.rows; y += kReadingStep) {
    const float* row = depth.ptr<float>(y);
    for (int x = kReadingStep / 2; x < depth.cols; x += kReadingStep) {
      now.push_back(row[x] > 0 ? row[x] : 0.f);
      with_depth += row[x] > 0;
    }
  }
  // With noise so many are never all equal.
  const bool same = with_depth >= kEnough && now == last_;
  last_ = std::move(now);
  return same;
}

}  // namespace vip_slam
