// SPDX-License-Identifier: BSD-3-Clause
// The records of 64 bytes that the phone sends for ever: IMU, intrinsics of each image, its own pose, camera format.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {

/// Axes of the body: x right, y up, z out of the screen of the upright phone.
struct ImuRecord {
  std::optional<Eigen::Vector3d> gyro;   ///< rad/s
  std::optional<Eigen::Vector3d> accel;  ///< specific force, m/s^2, +9.8 along what points up at rest
};

/// Camera of one image. `exposure` in s; 0 where the phone does not tell.
struct IntrinsicsRecord {
  CameraIntrinsics camera;
  double exposure = 0;
  bool snapshot = false;  ///< repeats the present value, not of one image
};

/// Of the camera in ARKit's world (y up), optical axes (z forward, y down).
struct PoseRecord {
  SE3 T_world_cam;
  int tracking = 0;    ///< 0 none, 1 limited, 2 normal
  bool moved = false;  ///< the world moved: no motion may be told from this pose and the one before
};

struct FormatRecord {
  int width = 0, height = 0;
  double rate = 0;     ///< images a second
  double readout = 0;  ///< s from the first row to the last; 0 where it is not known
  bool arkit = false;
};

struct Record {
  std::uint16_t sequence = 0;
  double host_time = 0, unix_time = 0;  ///< s
  /// Nothing: a type that is of no use here.
  std::variant<std::monostate, ImuRecord, IntrinsicsRecord, PoseRecord, FormatRecord> what;
};

constexpr std::size_t kRecordBytes = 64;

/// Throws WireError on another size and on times or values that are no numbers.
Record parseRecord(const Bytes& bytes);

}  // namespace vip_slam::phone
