// SPDX-License-Identifier: BSD-3-Clause
// Where the image's edges lie beside those of registered depth: cross-correlation of the two over all shifts, round the
// image's border as well, since a torn image is wrapped round. Small images, summed over a second each and in all.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/preflight/recording.h"

namespace vip_slam {

class EdgeShifts {
 public:
  /// `grey`: 8UC1; `depth`: 32FC1 metres, aligned to it, at the same time `t`. Images of another size are left out.
  void add(double t, const cv::Mat& grey, const cv::Mat& depth);
  EdgeShiftRecord record() const;

 private:
  struct Sum {
    double t = 0;         ///< of the first image
    cv::Mat correlation;  ///< 32FC1, in cells
    int images = 0;
    void add(const cv::Mat& one);
    EdgeShift shift(double cell) const;
  };
  double cell_ = 1;
  std::vector<Sum> seconds_;
  Sum near_, far_;
  double near_inverse_ = 0, far_inverse_ = 0;  ///< sums of the images' mean 1/z of those edges
};

}  // namespace vip_slam
