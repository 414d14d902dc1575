// SPDX-License-Identifier: BSD-3-Clause
// Geometry: core types <-> geometry_msgs. Exact both ways up to the normalisation of quaternions.
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <geometry_msgs/Vector3.h>
#include <ros/time.h>
#include <Eigen/Core>
#include <boost/array.hpp>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/depth/depth_shift.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

geometry_msgs::Point toPointMsg(const Eigen::Vector3d& p);
geometry_msgs::Vector3 toVectorMsg(const Eigen::Vector3d& v);
geometry_msgs::Pose toPoseMsg(const SE3& T);
geometry_msgs::Transform toTransformMsg(const SE3& T);

Eigen::Vector3d fromMsg(const geometry_msgs::Point& p);
Eigen::Vector3d fromMsg(const geometry_msgs::Vector3& v);
/// Throw std::invalid_argument when the orientation is no unit quaternion (within 1 %): unset or not finite.
SE3 fromMsg(const geometry_msgs::Pose& pose);
SE3 fromMsg(const geometry_msgs::Transform& transform);

boost::array<double, 4> toArray(const BearingCorrection& bearing);
boost::array<double, 4> toArray(const DepthShift& shift);
DepthShift shiftFromArray(const boost::array<double, 4>& shift);
BearingCorrection bearingFromArray(const boost::array<double, 4>& bearing);

/// Seconds to stamp; stamps that came from toSec() return exactly. Negative and non-finite times become 0.
ros::Time toStamp(double t);

}  // namespace vip_slam
