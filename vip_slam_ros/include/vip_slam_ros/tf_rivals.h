// SPDX-License-Identifier: BSD-3-Clause
// Finds out who else publishes the transform that a nodelet publishes: an odometry of the robot's, a recorded /tf that
// is played, a second launch. tf takes what comes last, so that the frame jumps to and fro between the two.
#pragma once

#include <mutex>
#include <string>

#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>

namespace vip_slam {

/// Thread-safe.
class TfRivals {
 public:
  /// `parent` -> `child` is what this nodelet publishes, as node `self`.
  TfRivals(const std::string& parent, const std::string& child, const std::string& self);

  /// Adds what comes on /tf and /tf_static, in the threads of `nh`.
  void listen(ros::NodeHandle& nh);
  /// `publisher`: name of the node that sent the message; `are_static`: of /tf_static, which counts for good.
  void add(const tf2_msgs::TFMessage& message, const std::string& publisher, double now, bool are_static);
  /// In words, when one was heard in the last seconds before `now`; else empty.
  std::string words(double now) const;

 private:
  const std::string parent_, child_, self_;
  mutable std::mutex mutex_;
  std::string rival_, their_parent_;
  double last_ = -1e300;  ///< seconds
  bool lasting_ = false;
  ros::Subscriber moving_, fixed_;
};

}  // namespace vip_slam
