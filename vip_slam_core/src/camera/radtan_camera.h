// SPDX-License-Identifier: BSD-3-Clause
// Pinhole with radial-tangential (Brown-Conrady) distortion, polynomial or rational; without distortion the plain
// pinhole.
#pragma once

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class PinholeCamera : public CameraModel {
 public:
  explicit PinholeCamera(const CameraIntrinsics& intrinsics) : CameraModel(intrinsics) {}
  Eigen::Vector2d distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const override;
  bool undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const override;
};

class RadTanCamera : public CameraModel {
 public:
  explicit RadTanCamera(const CameraIntrinsics& intrinsics);
  Eigen::Vector2d distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const override;
  bool undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const override;

 private:
  /// Distorted normalised coordinates and their Jacobian.
  Eigen::Vector2d distortNormalised(const Eigen::Vector2d& xy, Eigen::Matrix2d* J) const;

  double k1_ = 0, k2_ = 0, p1_ = 0, p2_ = 0, k3_ = 0, k4_ = 0, k5_ = 0, k6_ = 0;
};

}  // namespace vip_slam
