#include "vip_slam_ros/geometry_conversions.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace vip_slam {
namespace {

// An orientation that is none must not pass for "no rotation".
SE3 makeTransform(double qw, double qx, double qy, double qz, const Eigen::Vector3d& t) {
  const Eigen::Quaterniond q(qw, qx, qy, qz);
  if (!(std::abs(q.norm() - 1) < 1e-2))
    throw std::invalid_argument("orientation: (x, y, z, w) = (" + std::to_string(qx) + ", " + std::to_string(qy) +
                                ", " + std::to_string(qz) + ", " + std::to_string(qw) +
                                "), expected a unit quaternion");
  return SE3(q, t);
}

template <class Message>
void setQuaternion(const SE3& T, Message& q) {
  q.w = T.rotation().w();
  q.x = T.rotation().x();
  q.y = T.rotation().y();
  q.z = T.rotation().z();
}

}  // namespace

geometry_msgs::Point toPointMsg(const Eigen::Vector3d& p) {
  geometry_msgs::Point msg;
  msg.x = p.x();
  msg.y = p.y();
  msg.z = p.z();
  return msg;
}

geometry_msgs::Vector3 toVectorMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 msg;
  msg.x = v.x();
  msg.y = v.y();
  msg.z = v.z();
  return msg;
}

geometry_msgs::Pose toPoseMsg(const SE3& T) {
  geometry_msgs::Pose msg;
  msg.position = toPointMsg(T.t());
  setQuaternion(T, msg.orientation);
  return msg;
}

geometry_msgs::Transform toTransformMsg(const SE3& T) {
  geometry_msgs::Transform msg;
  msg.translation = toVectorMsg(T.t());
  setQuaternion(T, msg.rotation);
  return msg;
}

Eigen::Vector3d fromMsg(const geometry_msgs::Point& p) { return {p.x, p.y, p.z}; }
Eigen::Vector3d fromMsg(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }

SE3 fromMsg(const geometry_msgs::Pose& pose) {
  const auto& q = pose.orientation;
  return makeTransform(q.w, q.x, q.y, q.z, fromMsg(pose.position));
}

SE3 fromMsg(const geometry_msgs::Transform& transform) {
  const auto& q = transform.rotation;
  return makeTransform(q.w, q.x, q.y, q.z, fromMsg(transform.translation));
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
