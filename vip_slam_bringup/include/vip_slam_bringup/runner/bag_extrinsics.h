// SPDX-License-Identifier: BSD-3-Clause
// Camera-IMU extrinsics from the bag's tf, by the rules of the front-end nodelet: frame names are those of the
// messages, /tf_static is used always, and /tf when it is early enough.
#pragma once

#include <optional>
#include <string>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_ros/bag_files.h"

namespace vip_slam {

/// The frames of the first messages within a part of the bag, and the transform between them.
struct BagExtrinsics {
  std::string camera_frame, imu_frame;  ///< empty: no such message, or the driver leaves the name empty
  std::optional<SE3> T_imu_cam;         ///< none when tf does not connect the two
};

/// /tf is read for `patience` seconds from `begin` on.
BagExtrinsics extrinsicsInBag(const BagSet& bags, const SensorTopics& topics, const ros::Time& begin, double patience);

}  // namespace vip_slam
