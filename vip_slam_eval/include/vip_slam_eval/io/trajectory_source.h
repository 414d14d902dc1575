// SPDX-License-Identifier: BSD-3-Clause
// Trajectories from text files or from bags.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_eval/metrics/trajectory_consistency.h"

namespace vip_slam {

/// A bag when `path` ends in .bag, else a text file (trajectory_text.h, which explains `times`). From a bag:
/// nav_msgs/Odometry, geometry_msgs/PoseStamped or geometry_msgs/PoseWithCovarianceStamped of `topic` (empty: the only
/// such topic). Throws std::runtime_error naming the file, the topic and what was expected: no or several such topics,
/// repeated or unordered stamps, a damaged bag. `covariances`, when given, receives the poses whose covariance is not
/// all zero. `ran_back`: as for readTum.
Trajectory readTrajectory(const std::string& path, const std::string& topic = "",
                          std::vector<PoseWithCovariance>* covariances = nullptr, const std::string& times = "",
                          std::string* ran_back = nullptr);

/// The covariances of `odometry_covariance.csv`, each with the pose of `trajectory` that has its stamp. Throws
/// std::runtime_error naming the file and line: unreadable numbers, a stamp without a pose. Where stamps run backwards
/// rows are left out until time goes on, as poses are.
std::vector<PoseWithCovariance> readCovariances(const std::string& path, const Trajectory& trajectory);

}  // namespace vip_slam
