// SPDX-License-Identifier: BSD-3-Clause
// The pinhole camera of the front end's tests: 640 x 480, no distortion, 400 pixels of focal length in most of them.
#pragma once

#include <memory>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

constexpr double kFocal = 400, kCx = 319.5, kCy = 239.5;

inline std::shared_ptr<const CameraModel> testCamera(double focal = kFocal) {
  CameraIntrinsics intrinsics;
  intrinsics.width = 640;
  intrinsics.height = 480;
  intrinsics.fx = intrinsics.fy = focal;
  intrinsics.cx = kCx;
  intrinsics.cy = kCy;
  return makeCamera(intrinsics);
}

}  // namespace vip_slam
