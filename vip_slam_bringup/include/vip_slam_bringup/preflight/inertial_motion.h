// SPDX-License-Identifier: BSD-3-Clause
// The camera's velocity from images and depth against the accelerometer: whether accelerometer and gyroscope have the
// same axes, and how long a metre of depth is.
//
// Within a window of a second or two, in the axes that the IMU has at its start, with R(t) integrated from the gyro,
//   v(t) = k (integral of R P a) + k R (omega x arm) + c + h t:
// v: velocity from images and depth; a: what the accelerometer reports; P maps its axes to the gyro's, one of the 48
// signed permutations; c and h, free in each window, take the velocity at the start, gravity, and slow errors of
// attitude and bias. 1/k is metres per metre of depth: only the shape of the motion tells it, not gravity. P is seen by
// gravity, which must not turn with the sensor.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_bringup/preflight/readout.h"

namespace vip_slam {

struct InertialMotion {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< P, gyro_axes_from_accelerometer_axes; determinant 1 or -1
  bool axes_known = false;                             ///< no other P comes near, in both halves of the recording
  double scale = 1;                                    ///< 1/k, with P as found
  double scale_sigma = 0;                              ///< one sigma, from the scatter between windows; 0: not known
  double explained = 0;                                ///< share of the velocity's variance, with P as found
};

/// `arm`: of the camera in the IMU's frame, metres. Empty where there are too few windows that the images cover.
std::optional<InertialMotion> fitInertialMotion(const ReadoutEstimate& motion, const std::vector<StampedVector>& gyro,
                                                const std::vector<StampedVector>& accel, const Eigen::Vector3d& arm);

}  // namespace vip_slam
