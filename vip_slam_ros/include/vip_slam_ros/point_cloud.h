// Coloured point clouds without PCL.
#pragma once

#include <vector>

#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <Eigen/Core>

namespace vip_slam {

struct ColoredPoint {
  Eigen::Vector3f p;
  std_msgs::ColorRGBA color;
};

/// Fields x, y, z, rgb (packed as rviz and PCL read it), metres.
sensor_msgs::PointCloud2 toPointCloud(const std::vector<ColoredPoint>& points, const std_msgs::Header& header);

}  // namespace vip_slam
