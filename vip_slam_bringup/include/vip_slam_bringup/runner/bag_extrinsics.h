// The camera's place on the IMU as tf in the bag has it, by the rule of the front-end nodelet: frame names of messages
// decide, /tf_static counts always and /tf when it comes early.
#pragma once

#include <optional>
#include <string>

#include <rosbag/bag.h>

#include "vip_slam_core/sensor/sensor_config.h"

namespace vip_slam {

/// The frames that the first messages within a part of the bag name, and how tf connects them.
struct BagExtrinsics {
  std::string camera_frame, imu_frame;  ///< empty: no such message, or its driver leaves the name empty
  std::optional<SE3> T_imu_cam;         ///< none when tf does not connect the two
};

/// /tf is read for `patience` seconds from `begin` on.
BagExtrinsics extrinsicsInBag(const rosbag::Bag& bag, const SensorTopics& topics, const ros::Time& begin,
                              double patience);

}  // namespace vip_slam
