// SPDX-License-Identifier: BSD-3-Clause
// Map updates and loop events: core types <-> messages, without loss.
#pragma once

#include <string>

#include <vip_slam_msgs/LoopEvent.h>
#include <vip_slam_msgs/MapUpdate.h>

#include "vip_slam_core/types/map_update.h"

namespace vip_slam {

vip_slam_msgs::LoopEvent toMsg(const LoopEvent& loop);
vip_slam_msgs::MapUpdate toMsg(const MapUpdate& update, const std::string& map_frame);

LoopEvent fromMsg(const vip_slam_msgs::LoopEvent& msg);
/// Throws std::invalid_argument naming the plane when a normal has no unit length.
MapUpdate fromMsg(const vip_slam_msgs::MapUpdate& msg);

}  // namespace vip_slam
