// SPDX-License-Identifier: BSD-3-Clause
// Depth from a disparity that is known in steps of a fraction of a pixel (structured light, stereo).
#pragma once

namespace vip_slam {

class DisparitySteps {
 public:
  /// `focal_baseline`: focal length times baseline, px m; `step`: px, 0 for none.
  DisparitySteps(double focal_baseline, double step)
      : steps_(step > 0 ? static_cast<float>(focal_baseline / step) : 0.f) {}

  /// The depth of the nearest step of disparity; not positive when z is beyond the last.
  float operator()(float z) const {
    if (steps_ <= 0 || z <= 0) return z;
    const float disparity = static_cast<float>(static_cast<int>(steps_ / z + 0.5f));
    return disparity > 0 ? steps_ / disparity : 0.f;
  }

 private:
  float steps_;  ///< steps of disparity at a metre
};

}  // namespace vip_slam
