// SPDX-License-Identifier: BSD-3-Clause
// Where the camera of an iPhone or iPad sits: one place for its recordings and its live streams.
#pragma once

#include <cmath>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// Optical axes of the landscape image in the axes of CoreMotion (x right, y up, z out of the screen, phone upright):
/// the image's x points down the upright phone, its y to the phone's left. The camera lies 3 cm along the IMU's x, as
/// measured on two phones; differs by model, by up to a few centimetres.
inline SE3 phoneCameraInImu() {
  Eigen::Matrix3d R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  return SE3(R, Eigen::Vector3d(0.03, 0, 0));
}

/// ARKit's world (y up) in one with z up.
inline SE3 arkitWorldZUp() {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX())), Eigen::Vector3d::Zero());
}

}  // namespace vip_slam
