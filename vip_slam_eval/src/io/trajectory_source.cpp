// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/io/trajectory_source.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "vip_slam_eval/io/trajectory_text.h"
#include "vip_slam_ros/bag_files.h"

namespace vip_slam {
namespace {

bool isPoseType(const std::string& type) {
  return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
         type == "geometry_msgs/PoseWithCovarianceStamped";
}

std::string chooseTopic(const rosbag::Bag& bag, const std::string& path, const std::string& wanted) {
  std::set<std::string> topics;
  std::string names;
  rosbag::View view(bag);
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    if (isPoseType(connection->datatype) && topics.insert(connection->topic).second) {
      names += (names.empty() ? "" : ", ") + connection->topic;
    }
  }
  if (names.empty()) names = "none";
  if (!wanted.empty()) {
    if (topics.count(wanted)) return wanted;
    throw std::runtime_error(path + ": " + wanted + ": no topic of poses; topics of poses: " + names);
  }
  if (topics.size() == 1) return *topics.begin();
  throw std::runtime_error(path +
                           ": expected one topic of Odometry or PoseStamped or its name; topics of poses: " + names);
}

SE3 poseOf(const geometry_msgs::Pose& pose) {
  const Eigen::Quaterniond q(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z);
  return SE3(q, Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z));
}

bool usable(const geometry_msgs::Pose& pose) {
  const Eigen::Vector4d q(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w);
  const Eigen::Vector3d p(pose.position.x, pose.position.y, pose.position.z);
  return p.allFinite() && std::abs(q.norm() - 1.0) < 0.05;
}

Trajectory readBag(const std::string& path, const std::string& wanted, std::vector<PoseWithCovariance>* covariances) {
  rosbag::Bag bag;
  openBag(path, &bag);
  const std::string topic = chooseTopic(bag, path, wanted);
  Trajectory trajectory;
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& message : view) {
    ros::Time stamp;
    geometry_msgs::Pose pose;
    const boost::array<double, 36>* covariance = nullptr;
    const auto odometry = message.instantiate<nav_msgs::Odometry>();
    const auto stamped = message.instantiate<geometry_msgs::PoseStamped>();
    const auto with_covariance = message.instantiate<geometry_msgs::PoseWithCovarianceStamped>();
    if (odometry) {
      stamp = odometry->header.stamp, pose = odometry->pose.pose, covariance = &odometry->pose.covariance;
    } else if (stamped) {
      stamp = stamped->header.stamp, pose = stamped->pose;
    } else if (with_covariance) {
      stamp = with_covariance->header.stamp, pose = with_covariance->pose.pose;
      covariance = &with_covariance->pose.covariance;
    } else {
      continue;
    }
    const double t = stamp.toSec();
    const std::string where = path + ": " + topic + " at " + std::to_string(t) + ": ";
    if (!trajectory.empty() && !(t > trajectory.back().t)) {
      throw std::runtime_error(where + "repeats or precedes the stamp before it, expected ascending stamps");
    }
    if (!usable(pose)) throw std::runtime_error(where + "no pose, expected finite numbers and a unit quaternion");
    trajectory.push_back({t, poseOf(pose)});
    if (!covariances || !covariance) continue;
    PoseWithCovariance sample{t, trajectory.back().T_W_B,
                              Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariance->data())};
    if (sample.covariance.cwiseAbs().maxCoeff() > 0) covariances->push_back(sample);
  }
  return trajectory;
}

}  // namespace

Trajectory readTrajectory(const std::string& path, const std::string& topic,
                          std::vector<PoseWithCovariance>* covariances, const std::string& times,
                          std::string* ran_back) {
  const bool is_bag = path.size() > 4 && path.compare(path.size() - 4, 4, ".bag") == 0;
  Trajectory trajectory;
  if (!is_bag) {
    trajectory = readTextTrajectory(path, times, ran_back);
  } else {
    try {
      trajectory = readBag(path, topic, covariances);
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error(path + ": cannot be read as a bag (" + error.what() + "), expected a complete bag");
    }
  }
  if (trajectory.empty()) throw std::runtime_error(path + ": holds no pose, expected at least one");
  return trajectory;
}

}  // namespace vip_slam
