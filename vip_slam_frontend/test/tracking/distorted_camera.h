// SPDX-License-Identifier: BSD-3-Clause
// A rolling-shutter camera with some radial distortion, its centre in the middle of the image.
#pragma once

#include <memory>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

constexpr double kReadout = 0.02;  ///< from the first row to the last, s

inline std::shared_ptr<const CameraModel> distortedCamera(int width, int height, double focal) {
  CameraIntrinsics k;
  k.width = width;
  k.height = height;
  k.fx = k.fy = focal;
  k.cx = 0.5 * (width - 1);
  k.cy = 0.5 * (height - 1);
  k.model = DistortionModel::kRadTan;
  k.distortion = {-0.1, 0.02, 0, 0};
  return makeCamera(k);
}

}  // namespace vip_slam
