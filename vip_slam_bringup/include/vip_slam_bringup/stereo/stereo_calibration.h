// SPDX-License-Identifier: BSD-3-Clause
// A calibrated stereo pair as one YAML file:
//   left:  {width, height, fx, fy, cx, cy, model, distortion: [...], T_imu_cam: 4x4 as four rows}
//   right: likewise
#pragma once

#include <string>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct StereoCalibration {
  CameraIntrinsics left, right;
  SE3 T_imu_left, T_imu_right;  ///< optical frames into the IMU frame

  SE3 T_left_right() const { return T_imu_left.inverse() * T_imu_right; }
};

/// Throws std::runtime_error "file: left/fx: what, expected what".
StereoCalibration loadStereoCalibration(const std::string& path);

}  // namespace vip_slam
