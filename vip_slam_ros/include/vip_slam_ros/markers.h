// SPDX-License-Identifier: BSD-3-Clause
// Building blocks of rviz markers.
#pragma once

#include <cstdint>
#include <string>

#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>

namespace vip_slam {

std_msgs::ColorRGBA makeColor(double r, double g, double b, double a = 1.0);
/// A constant colour per id that differs from those of neighbouring ids: hues in golden-ratio steps.
std_msgs::ColorRGBA colorOfId(std::uint64_t id, double alpha = 1.0);
/// An ADD marker with identity pose and unit scale.
visualization_msgs::Marker makeMarker(const std_msgs::Header& header, const std::string& ns, int id, int type);
visualization_msgs::Marker makeDeletion(const std_msgs::Header& header, const std::string& ns, int id);

}  // namespace vip_slam
