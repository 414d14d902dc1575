// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/geometry_conversions.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <tf2_eigen/tf2_eigen.h>

namespace vip_slam {
namespace {

// An orientation that is none must not pass for "no rotation".
SE3 makeTransform(const geometry_msgs::Quaternion& rotation, const Eigen::Vector3d& t) {
  Eigen::Quaterniond q;
  tf2::fromMsg(rotation, q);
  if (!(std::abs(q.norm() - 1) < 1e-2))
    throw std::invalid_argument("orientation: (x, y, z, w) = (" + std::to_string(q.x()) + ", " + std::to_string(q.y()) +
                                ", " + std::to_string(q.z()) + ", " + std::to_string(q.w()) +
                                "), expected a unit quaternion");
  return SE3(q, t);
}

template <class Message>
Eigen::Vector3d toEigen(const Message& msg) {
  Eigen::Vector3d v;
  tf2::fromMsg(msg, v);
  return v;
}

}  // namespace

// Of tf2_eigen the vectors and quaternions: its poses go by way of a rotation matrix and would not come back the same.

geometry_msgs::Point toPointMsg(const Eigen::Vector3d& p) { return tf2::toMsg(p); }

geometry_msgs::Vector3 toVectorMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 msg;
  return tf2::toMsg(v, msg);
}

geometry_msgs::Pose toPoseMsg(const SE3& T) {
  geometry_msgs::Pose msg;
  msg.position = toPointMsg(T.t());
  msg.orientation = tf2::toMsg(T.rotation());
  return msg;
}

geometry_msgs::Transform toTransformMsg(const SE3& T) {
  geometry_msgs::Transform msg;
  msg.translation = toVectorMsg(T.t());
  msg.rotation = tf2::toMsg(T.rotation());
  return msg;
}

Eigen::Vector3d fromMsg(const geometry_msgs::Point& p) { return toEigen(p); }
Eigen::Vector3d fromMsg(const geometry_msgs::Vector3& v) { return toEigen(v); }

SE3 fromMsg(const geometry_msgs::Pose& pose) { return makeTransform(pose.orientation, fromMsg(pose.position)); }

SE3 fromMsg(const geometry_msgs::Transform& transform) {
  return makeTransform(transform.rotation, fromMsg(transform.translation));
}

boost::array<double, 4> toArray(const BearingCorrection& bearing) {
  boost::array<double, 4> values;
  Eigen::Map<Eigen::Vector4d>(values.data()) = bearing.value;
  return values;
}

boost::array<double, 4> toArray(const DepthShift& shift) {
  return {{shift.px.x(), shift.px.y(), shift.bearing.x(), shift.bearing.y()}};
}

DepthShift shiftFromArray(const boost::array<double, 4>& shift) { return {{shift[0], shift[1]}, {shift[2], shift[3]}}; }

BearingCorrection bearingFromArray(const boost::array<double, 4>& bearing) {
  return {Eigen::Map<const Eigen::Vector4d>(bearing.data())};
}

ros::Time toStamp(double t) {
  if (!std::isfinite(t) || !(t > 0)) return ros::Time();
  // A double of today's time has steps of 0.24 us. Of the stamps within that step the roundest one is chosen, since
  // drivers and simulators stamp with whole milliseconds or microseconds.
  const double seconds = std::floor(t);
  for (const double unit : {1e3, 1e6}) {
    const ros::Time round =
        ros::Time(static_cast<std::uint32_t>(seconds), 0) +
        ros::Duration(0, static_cast<std::int32_t>(std::lround((t - seconds) * unit) * (1e9 / unit)));
    if (round.toSec() == t) return round;
  }
  return ros::Time(t);
}

}  // namespace vip_slam
