// SPDX-License-Identifier: BSD-3-Clause
// The part of a depth camera's error that neighbouring pixels and images share, which averages out slowly or not at
// all: a wrong scale and offset, an error that a whole surface has in an image, a warp over the image, and one that
// stays.
#pragma once

#include "vip_slam_sim/render/lattice_noise.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

class SharedDepthError {
 public:
  SharedDepthError(const DepthOptions& options, int seed);

  bool none() const;
  /// Depth as the camera would measure it without white noise, `t` seconds into the sequence. CV_32FC1 metres, 0 where
  /// nothing is hit.
  cv::Mat apply(const FrameBuffers& frame, const Scene& scene, double t) const;

 private:
  DepthOptions options_;
  LatticeNoise surface_, warp_, fixed_;
};

}  // namespace vip_slam
