// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/tf_rivals.h"

#include "vip_slam_ros/tf_lookup.h"

namespace vip_slam {

TfRivals::TfRivals(const std::string& parent, const std::string& child, const std::string& self)
    : parent_(bareFrame(parent)), child_(bareFrame(child)), self_(self) {}

void TfRivals::listen(ros::NodeHandle& nh) {
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  const auto take = [this](bool are_static) {
    return boost::function<void(const Event&)>([this, are_static](const Event& event) {
      add(*event.getConstMessage(), event.getPublisherName(), ros::WallTime::now().toSec(), are_static);
    });
  };
  moving_ = nh.subscribe<tf2_msgs::TFMessage, const Event&>("/tf", 100, take(false));
  fixed_ = nh.subscribe<tf2_msgs::TFMessage, const Event&>("/tf_static", 100, take(true));
}

void TfRivals::add(const tf2_msgs::TFMessage& message, const std::string& publisher, double now, bool are_static) {
  if (publisher == self_) return;
  for (const auto& transform : message.transforms) {
    if (bareFrame(transform.child_frame_id) != child_) continue;
    std::lock_guard<std::mutex> lock(mutex_);
    rival_ = publisher;
    their_parent_ = bareFrame(transform.header.frame_id);
    last_ = now;
    lasting_ = are_static;
  }
}

std::string TfRivals::words(double now) const {
  constexpr double kLately = 5.0;  // seconds
  std::lock_guard<std::mutex> lock(mutex_);
  if (!lasting_ && now - last_ > kLately) return "";
  const std::string ours = "'" + parent_ + "' -> '" + child_ + "'";
  const std::string theirs = "'" + their_parent_ + "' -> '" + child_ + "'";
  return rival_ + " publishes " +
         (their_parent_ == parent_ ? ours + " too" : theirs + " while " + ours + " comes from here") +
         ": a frame has one parent and one source; switch theirs off, or publish_tf here";
}

}  // namespace vip_slam
