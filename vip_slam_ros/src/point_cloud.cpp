// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/point_cloud.h"

#include <algorithm>
#include <cmath>

// The filter is compiled here: for one template libpcl_filters would load 30 MB of libraries into every program.
#define PCL_NO_PRECOMPILE
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>

namespace vip_slam {

void addPoint(const Eigen::Vector3f& p, const std_msgs::ColorRGBA& color, ColoredCloud* cloud) {
  const auto byte = [](float v) { return std::uint8_t(std::lround(255.0f * std::clamp(v, 0.0f, 1.0f))); };
  pcl::PointXYZRGB point;
  point.getVector3fMap() = p;
  point.r = byte(color.r);
  point.g = byte(color.g);
  point.b = byte(color.b);
  cloud->push_back(point);
}

void thin(double voxel, ColoredCloud* cloud) {
  pcl::VoxelGrid<pcl::PointXYZRGB> grid;
  grid.setInputCloud(cloud->makeShared());
  grid.setLeafSize(float(voxel), float(voxel), float(voxel));
  grid.filter(*cloud);
}

sensor_msgs::PointCloud2 toPointCloud(const ColoredCloud& cloud, const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 message;
  pcl::toROSMsg(cloud, message);
  message.header = header;
  return message;
}

}  // namespace vip_slam
