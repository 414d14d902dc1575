// SPDX-License-Identifier: BSD-3-Clause
// Planes: core types <-> messages, without loss.
#pragma once

#include <string>
#include <vector>

#include <vip_slam_msgs/Plane.h>
#include <vip_slam_msgs/PlaneHost.h>
#include <vip_slam_msgs/PlaneMap.h>
#include <vip_slam_msgs/PlaneObservation.h>
#include <vip_slam_msgs/PlaneUpdate.h>

#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

vip_slam_msgs::Plane toMsg(const PlaneEstimate& plane);
vip_slam_msgs::PlaneHost toMsg(const PlaneHost& host);
vip_slam_msgs::PlaneObservation toMsg(const PlaneObservation& observation);
vip_slam_msgs::PlaneUpdate toMsg(const PlaneUpdate& update, const std::string& map_frame);
vip_slam_msgs::PlaneMap toPlaneMapMsg(const std::vector<PlaneEstimate>& planes, double t, std::uint64_t revision,
                                      const std::string& map_frame);

/// Values are taken as they are: the map and the plane mapper refuse unusable planes one by one and by name.
PlaneEstimate fromMsg(const vip_slam_msgs::Plane& msg);
/// Throws std::invalid_argument naming plane and keyframe when its values of points are no multiple of four.
PlaneObservation fromMsg(const vip_slam_msgs::PlaneObservation& msg);
/// Leaves out observations that cannot be read, and adds the reasons to `refused`.
PlaneUpdate fromMsg(const vip_slam_msgs::PlaneUpdate& msg, std::vector<std::string>* refused);
/// Throws std::invalid_argument when there is not one host for each plane, or on a pose that is none.
std::vector<StoredPlane> fromMsg(const std::vector<vip_slam_msgs::Plane>& planes,
                                 const std::vector<vip_slam_msgs::PlaneHost>& hosts);

}  // namespace vip_slam
