// SPDX-License-Identifier: BSD-3-Clause
// How a camera differs from its calibration: focal lengths, centre and distortion, drawn by a seed and scaled so that
// pixels are off by a given number.
#pragma once

#include <cstdint>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class CameraModelError {
 public:
  /// `px`: root mean square over the image, 0 for none.
  CameraModelError(double px, int seed) : px_(px), seed_(static_cast<std::uint64_t>(seed)) {}

  /// The camera whose calibration says `stated`.
  CameraIntrinsics trueCamera(const CameraIntrinsics& stated) const;
  /// Root mean square distance over the image between the pixels of a and those by which b sees the same directions.
  static double difference(const CameraIntrinsics& a, const CameraIntrinsics& b);

 private:
  double px_;
  std::uint64_t seed_;
};

}  // namespace vip_slam
