// SPDX-License-Identifier: BSD-3-Clause
// The front end's output: core types <-> messages, without loss.
#pragma once

#include <string>

#include <vip_slam_msgs/Feature.h>
#include <vip_slam_msgs/ImuSample.h>
#include <vip_slam_msgs/Keyframe.h>
#include <vip_slam_msgs/NavState.h>
#include <vip_slam_msgs/TrackedFrame.h>
#include <vip_slam_msgs/TrackingStatus.h>

#include "vip_slam_core/types/keyframe.h"

namespace vip_slam {

vip_slam_msgs::TrackingStatus toMsg(const TrackingStatus& status);
vip_slam_msgs::ImuSample toMsg(const ImuSample& sample);
vip_slam_msgs::NavState toMsg(const NavState& state);
vip_slam_msgs::Feature toMsg(const Feature& feature);
vip_slam_msgs::DepthGrid toMsg(const DepthGrid& grid);
vip_slam_msgs::TrackedFrame toMsg(const TrackedFrame& frame, const std::string& odom_frame);
vip_slam_msgs::Keyframe toMsg(const Keyframe& keyframe, const std::string& odom_frame);

/// All throw std::invalid_argument naming the field when a message is inconsistent (an unknown state, a depth grid
/// whose size is not cols x rows).
TrackingStatus fromMsg(const vip_slam_msgs::TrackingStatus& msg);
ImuSample fromMsg(const vip_slam_msgs::ImuSample& msg);
NavState fromMsg(const vip_slam_msgs::NavState& msg);
Feature fromMsg(const vip_slam_msgs::Feature& msg);
DepthGrid fromMsg(const vip_slam_msgs::DepthGrid& msg);
TrackedFrame fromMsg(const vip_slam_msgs::TrackedFrame& msg);
/// Of its image, s, on a clock that goes on.
double timeOf(const vip_slam_msgs::TrackedFrame& msg);
Keyframe fromMsg(const vip_slam_msgs::Keyframe& msg);

}  // namespace vip_slam
