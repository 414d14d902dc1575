// SPDX-License-Identifier: BSD-3-Clause
// What the map believes of camera and gyroscope: corrections estimated by the front end and from the map, applied to
// all keyframes of the session.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam::backend {

class AdoptedCalibration {
 public:
  /// Takes the front end's newest correction of the camera to the map where an adjustment to it is due. `keyframes`:
  /// number received so far. False when the map stays as it is.
  bool follow(const CameraCorrection& newest, std::uint64_t keyframes, Map* map);
  /// The same for the gyroscope.
  bool followGyro(const Eigen::Matrix3d& newest, std::uint64_t keyframes, const ImuNoise& noise, Map* map);
  /// Estimates the depth camera's distance-dependent error from the map and applies a significant change. `disparity`:
  /// for a camera that measures disparities their error is estimated; without, nothing is. False when nothing changed.
  bool learnDepthCurve(const DepthNoise& noise, bool disparity, Map* map);
  /// Takes the newest corrections to the map however little they differ, for a global adjustment.
  void adoptNewest(const ImuNoise& noise, Map* map);
  void reset() { *this = AdoptedCalibration(); }

  const CameraCorrection& camera() const { return camera_; }
  /// 1/m, corrected by the curve.
  double disparityError() const { return disparity_error_; }

 private:
  /// The front end's values move with every second of data, the first ones most. An adjustment to new ones is due with
  /// half as many keyframes again as there were at the last one.
  static bool isDue(std::uint64_t keyframes, std::uint64_t* at_change);

  CameraCorrection camera_;                                ///< applied
  CameraCorrection newest_camera_;                         ///< reported last; same curve
  std::uint64_t keyframes_at_camera_ = 0;                  ///< received when it was taken to the map
  double disparity_error_ = 0;                             ///< 1/m
  Eigen::Matrix3d gyro_ = Eigen::Matrix3d::Zero();         ///< applied
  Eigen::Matrix3d newest_gyro_ = Eigen::Matrix3d::Zero();  ///< reported last
  std::uint64_t keyframes_at_gyro_ = 0;
};

}  // namespace vip_slam::backend
