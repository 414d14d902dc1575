// How long a rolling shutter takes from the first row of an image to its last, and by how much its stamps lag.
//
// A corner seen at row a of one image and row b of the next was seen at the times t0 + td + r a and t1 + td + r b.
// Between those the gyro tells how the camera turned; its speed, the same for all corners of the two images, is left to
// them. The readout r, the delay td, the camera's rotation on the IMU and the gyro's bias are what fits all corners of
// all images best: Gauss and Newton with weights of Huber, the speeds eliminated image by image.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "vip_slam_bringup/preflight/gyro_integral.h"

namespace vip_slam {

struct ReadoutEstimate {
  double time_offset = 0;  ///< seconds; t_imu = t_image + time_offset for the middle row
  double readout = 0;      ///< seconds; negative: the last row comes first
  Eigen::Quaterniond R_imu_cam = Eigen::Quaterniond::Identity();
  double time_sigma = 0, readout_sigma = 0;  ///< seconds, from the scatter of the images among each other
};

/// `start`: where the search begins. Empty when there are too few corners with depth or they do not settle it.
std::optional<ReadoutEstimate> estimateReadout(const std::vector<RotationStep>& steps, const GyroIntegral& gyro,
                                               const ReadoutEstimate& start);

}  // namespace vip_slam
