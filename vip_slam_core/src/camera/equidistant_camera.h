// SPDX-License-Identifier: BSD-3-Clause
// Equidistant fisheye (Kannala-Brandt): theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
#pragma once

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class EquidistantCamera : public CameraModel {
 public:
  explicit EquidistantCamera(const CameraIntrinsics& intrinsics);
  Eigen::Vector2d distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const override;
  bool undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const override;

 private:
  /// theta_d and its derivative by theta.
  double distortAngle(double theta, double* derivative) const;

  double k_[4] = {0, 0, 0, 0};
  double max_angle_;  ///< theta_d grows up to here, radians
};

}  // namespace vip_slam
