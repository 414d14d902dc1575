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

/// All throw std::invalid_argument naming the field when a message is inconsistent (an unknown kind, a normal not
/// of unit length, a number of point values that is not a multiple of four).
PlaneEstimate fromMsg(const vip_slam_msgs::Plane& msg);
PlaneObservation fromMsg(const vip_slam_msgs::PlaneObservation& msg);
PlaneUpdate fromMsg(const vip_slam_msgs::PlaneUpdate& msg);
/// Throws std::invalid_argument when there is not one host for each plane.
std::vector<StoredPlane> fromMsg(const std::vector<vip_slam_msgs::Plane>& planes,
                                 const std::vector<vip_slam_msgs::PlaneHost>& hosts);

}  // namespace vip_slam
