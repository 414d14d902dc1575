// SPDX-License-Identifier: BSD-3-Clause
// An image that was compressed as JPEG on its way.
#pragma once

#include <opencv2/core.hpp>

namespace vip_slam {

class JpegCompression {
 public:
  /// 1 to 100, 0 for none.
  explicit JpegCompression(int quality) : quality_(quality) {}
  /// 8UC3 RGB.
  void apply(cv::Mat* rgb) const;

 private:
  int quality_;
};

}  // namespace vip_slam
