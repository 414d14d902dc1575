// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/coarse_depth.h"

#include <algorithm>
#include <cstdint>

namespace vip_slam {

void CoarseDepth::apply(cv::Mat* depth) const {
  if (every_ <= 1) return;
  const cv::Mat fine = depth->clone();
  // Readings lie in the middle of their blocks.
  const int cols = fine.cols / every_, rows = fine.rows / every_;
  const auto reading = [&](int y, int x) {
    x = std::clamp(x, 0, cols - 1);
    y = std::clamp(y, 0, rows - 1);
    return static_cast<float>(fine.at<std::uint16_t>(y * every_ + every_ / 2, x * every_ + every_ / 2));
  };
  const auto middle = static_cast<float>(every_ / 2), step = static_cast<float>(every_);
  for (int v = 0; v < fine.rows; ++v) {
    const float y = (static_cast<float>(v) - middle) / step;
    const int y0 = y < 0 ? -1 : static_cast<int>(y);
    for (int u = 0; u < fine.cols; ++u) {
      const float x = (static_cast<float>(u) - middle) / step;
      const int x0 = x < 0 ? -1 : static_cast<int>(x);
      const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
      float sum = 0;
      bool valid = true;
      for (int k = 0; k < 4; ++k) {
        const float weight = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
        if (weight <= 0) continue;
        const float mm = reading(y0 + k / 2, x0 + k % 2);
        valid = valid && mm > 0;
        sum += weight * mm;
      }
      depth->at<std::uint16_t>(v, u) = valid ? static_cast<std::uint16_t>(sum + 0.5f) : 0;
    }
  }
}

}  // namespace vip_slam
