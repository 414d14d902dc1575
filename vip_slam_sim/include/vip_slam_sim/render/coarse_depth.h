// SPDX-License-Identifier: BSD-3-Clause
// Depth that is measured at every n-th pixel and enlarged to the colour image, as phones give it.
#pragma once

#include <opencv2/core.hpp>

namespace vip_slam {

class CoarseDepth {
 public:
  /// 1 for none.
  explicit CoarseDepth(int every) : every_(every) {}
  /// 16UC1, 0 = invalid: what lies between four readings of which one is invalid becomes invalid.
  void apply(cv::Mat* depth) const;

 private:
  int every_;
};

}  // namespace vip_slam
