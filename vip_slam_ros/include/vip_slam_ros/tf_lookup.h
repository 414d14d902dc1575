// Sensor extrinsics from tf, when the robot or the camera driver publishes them.
#pragma once

#include <optional>
#include <string>

#include <tf2_ros/buffer.h>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// The fixed transform T_target_source, newest available; empty when tf does not connect the frames (now).
std::optional<SE3> lookUpTransform(const tf2_ros::Buffer& buffer, const std::string& target,
                                   const std::string& source);

}  // namespace vip_slam
