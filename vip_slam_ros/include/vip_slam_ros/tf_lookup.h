// SPDX-License-Identifier: BSD-3-Clause
// Sensor extrinsics from tf, when the robot or the camera driver publishes them.
#pragma once

#include <optional>
#include <string>

#include <tf2/buffer_core.h>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// A frame's name without the leading slash that drivers from before tf2 prepend.
std::string bareFrame(const std::string& frame);

/// The fixed transform T_target_source, newest available; empty when tf does not connect the frames (now).
std::optional<SE3> lookUpTransform(const tf2::BufferCore& buffer, const std::string& target, const std::string& source);

/// T_imu_cam likewise. Empty as well when both messages name one frame: tf then knows nothing of the sensors' places,
/// but would answer with the identity, even for a frame that it never heard of.
std::optional<SE3> lookUpExtrinsics(const tf2::BufferCore& buffer, const std::string& imu_frame,
                                    const std::string& camera_frame);

/// Why lookUpExtrinsics() is empty, in words.
std::string whyNoExtrinsics(const std::string& imu_frame, const std::string& camera_frame);

/// Why a camera that far from its IMU is not believed, in words; empty when it is within `most` metres.
std::string leverArmProblem(const SE3& T_imu_cam, double most);

/// Difference of two camera-IMU extrinsics.
struct ExtrinsicsGap {
  double degrees = 0, metres = 0;
  /// More than mechanical tolerances: one of the two is wrong.
  bool large() const { return degrees > 3.0 || metres > 0.02; }
};
ExtrinsicsGap extrinsicsGap(const SE3& T_imu_cam_a, const SE3& T_imu_cam_b);

}  // namespace vip_slam
