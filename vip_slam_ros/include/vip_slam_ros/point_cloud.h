// SPDX-License-Identifier: BSD-3-Clause
// Coloured point clouds: pcl::PointCloud to a message. PCL's headers are needed by those alone who make a cloud.
#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/ColorRGBA.h>
#include <std_msgs/Header.h>
#include <Eigen/Core>

namespace pcl {
struct PointXYZRGB;
template <typename Point>
class PointCloud;
}  // namespace pcl

namespace vip_slam {

using ColoredCloud = pcl::PointCloud<pcl::PointXYZRGB>;

/// A point in metres; the colour's alpha is left out.
void addPoint(const Eigen::Vector3f& p, const std_msgs::ColorRGBA& color, ColoredCloud* cloud);

/// Leaves the mean of the points in each cube of side `voxel`, metres (pcl::VoxelGrid). A cloud with more cubes between
/// its ends than PCL can count stays as it is.
void thin(double voxel, ColoredCloud* cloud);

/// Fields x, y, z, rgb. The stamp is exact, unlike that of PCL's own header, which counts microseconds.
sensor_msgs::PointCloud2 toPointCloud(const ColoredCloud& cloud, const std_msgs::Header& header);

}  // namespace vip_slam
