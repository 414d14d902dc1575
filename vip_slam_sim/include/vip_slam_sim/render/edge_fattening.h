// SPDX-License-Identifier: BSD-3-Clause
// Foreground grown over the background at depth edges, as by the matching window of stereo and structured light.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_sim/render/lattice_noise.h"

namespace vip_slam {

class EdgeFattening {
 public:
  /// Up to `reach` pixels, unevenly along an edge; 0 for none.
  EdgeFattening(int reach, int seed);
  /// `depth`: CV_32FC1, 0 = nothing. `t`: seconds; where an edge grows most changes slowly.
  void apply(double t, cv::Mat* depth) const;

 private:
  int reach_;
  LatticeNoise uneven_;
};

}  // namespace vip_slam
