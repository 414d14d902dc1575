// SPDX-License-Identifier: BSD-3-Clause
// Whether two images are equal. By noise no two images of a camera are, so the comparison mostly ends with the first
// row.
#pragma once

#include <cstring>

#include <opencv2/core.hpp>

namespace vip_slam {

inline bool samePixels(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int v = 0; v < a.rows; ++v) {
    if (std::memcmp(a.ptr(v), b.ptr(v), bytes) != 0) return false;
  }
  return true;
}

}  // namespace vip_slam
