// SPDX-License-Identifier: BSD-3-Clause
// What a time-of-flight camera measures in concave corners: light that came by way of another surface makes distances
// long. One bounce, diffuse surfaces, a lamp beside the lens that lights what the camera sees: of all directions from a
// point, those that end on a lit surface add light whose way is longer; the camera measures the mean way, weighted by
// light.
#pragma once

#include "vip_slam_sim/render/renderer.h"

namespace vip_slam {

class Multipath {
 public:
  /// `reflectance` of the surfaces that light comes by, 0 for none.
  Multipath(double reflectance, std::shared_ptr<const Scene> scene, std::shared_ptr<const RayTracer> tracer);
  /// Adds the error to `depth` (CV_32FC1, z in metres, of `frame`, seen by `renderer` from T_W_C).
  void apply(const Renderer& renderer, const FrameBuffers& frame, const SE3& T_W_C, cv::Mat* depth) const;

 private:
  double reflectance_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const RayTracer> tracer_;
};

}  // namespace vip_slam
