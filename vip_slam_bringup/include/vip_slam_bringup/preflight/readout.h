// SPDX-License-Identifier: BSD-3-Clause
// Estimates the readout time of a rolling shutter, from the first row of an image to the last, and the camera-IMU
// delay.
//
// A corner seen at row a of one image and row b of the next was seen at the times t0 + td + r a and t1 + td + r b. The
// gyro gives the camera's rotation between those; its velocity, common to all corners of the two images, is a free
// parameter. The readout r, the delay td and its drift, the camera-IMU rotation and the gyro's bias are fitted to all
// corners of all images: Gauss-Newton with Huber weights, the velocities eliminated image by image.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "vip_slam_bringup/preflight/gyro_integral.h"

namespace vip_slam {

/// Motion of the camera between two images, from its corners with depth and the gyro's rotation.
struct StepFit {
  double t0 = 0, t1 = 0;                            ///< of the images' middle rows, seconds on the IMU's clock
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();  ///< mean velocity, m/s, in the colour optical frame at t0
  double error = 0;  ///< of the step's corners in the second image, median, normalised coordinates
};

struct ReadoutEstimate {
  double time_offset = 0;  ///< seconds; t_imu = t_image + time_offset for the middle row, at the time `middle`
  double readout = 0;      ///< seconds; negative: the last row is read first
  Eigen::Quaterniond R_imu_cam = Eigen::Quaterniond::Identity();
  double time_sigma = 0, readout_sigma = 0;             ///< one sigma, seconds, from the scatter between images
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  ///< rad/s
  std::vector<StepFit> fits;                            ///< of the steps with enough corners with depth
  double middle = 0;       ///< stamp halfway between the first and the last of the steps, seconds
  double time_drift = 0;   ///< seconds a second by which time_offset grows
  double drift_sigma = 0;  ///< one sigma

  /// Time on the IMU's clock of the middle row of an image that is stamped t.
  double imuTime(double t) const { return t + time_offset + time_drift * (t - middle); }
};

/// `start`: initial values. Empty when there are too few corners with depth or the fit is not determined.
std::optional<ReadoutEstimate> estimateReadout(const std::vector<RotationStep>& steps, const GyroIntegral& gyro,
                                               const ReadoutEstimate& start);

}  // namespace vip_slam
