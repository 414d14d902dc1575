// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/export/point_files.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZL>;

Cloud pointsOf(const Map& map) {
  Cloud cloud;
  cloud.reserve(map.landmarks().size());
  for (const LandmarkId id : map.landmarkIds()) {
    const MapLandmark& landmark = map.landmark(id);
    pcl::PointXYZL point;
    point.getVector3fMap() = landmark.p_W.cast<float>();
    point.label = std::uint32_t(landmark.plane);
    cloud.push_back(point);
  }
  return cloud;
}

void removeOutliers(double sigmas, Cloud* cloud) {
  constexpr int kNeighbours = 10;
  if (cloud->size() <= kNeighbours) return;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZL> removal;
  removal.setInputCloud(cloud->makeShared());
  removal.setMeanK(kNeighbours);
  removal.setStddevMulThresh(sigmas);
  removal.filter(*cloud);
}

void thin(double voxel, Cloud* cloud) {
  Eigen::Array3f low = cloud->front().getArray3fMap(), high = low;
  for (const auto& point : *cloud) {
    low = low.min(point.getArray3fMap());
    high = high.max(point.getArray3fMap());
  }
  const Eigen::Array3d cubes = ((high - low).cast<double>() / voxel).floor() + 2;
  if (cubes.prod() > double(std::numeric_limits<std::int32_t>::max()))  // PCL would leave the cloud as it is
    throw std::runtime_error(formatted("voxel: %g m, too small for a map of %.0f x %.0f x %.0f m", voxel,
                                       high.x() - low.x(), high.y() - low.y(), high.z() - low.z()));
  pcl::VoxelGrid<pcl::PointXYZL> grid;
  grid.setInputCloud(cloud->makeShared());
  grid.setLeafSize(float(voxel), float(voxel), float(voxel));
  grid.filter(*cloud);
}

/// `write` and `read` return 0 when done. What was written is read again: PCL does not notice a full disk.
template <class Write, class Read>
void writeWhole(const std::string& path, std::size_t points, const Write& write, const Read& read) {
  AtomicFile file(path);
  pcl::PCLPointCloud2 again;
  if (write(file.temporary()) != 0 || read(file.temporary(), again) != 0 ||
      std::size_t(again.width) * again.height != points)
    throw std::runtime_error(path + ": writing failed, is the disk full?");
  file.commit();
}

}  // namespace

std::size_t writePoints(const std::string& stem, const Map& map, const PointFilter& filter) {
  Cloud cloud = pointsOf(map);
  if (filter.outliers > 0) removeOutliers(filter.outliers, &cloud);
  if (filter.voxel > 0 && !cloud.empty()) thin(filter.voxel, &cloud);
  if (cloud.empty()) return 0;  // PCL writes no empty clouds
  writeWhole(
      stem + ".ply", cloud.size(),
      [&](const std::string& path) { return pcl::PLYWriter().write<pcl::PointXYZL>(path, cloud, false, false); },
      [](const std::string& path, pcl::PCLPointCloud2& again) { return pcl::PLYReader().read(path, again); });
  writeWhole(
      stem + ".pcd", cloud.size(), [&](const std::string& path) { return pcl::PCDWriter().writeASCII(path, cloud); },
      [](const std::string& path, pcl::PCLPointCloud2& again) { return pcl::PCDReader().read(path, again); });
  return cloud.size();
}

}  // namespace vip_slam
