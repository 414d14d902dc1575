// SPDX-License-Identifier: BSD-3-Clause
// The map's points for other programs; coordinates in `map`, metres; `label` is the plane a point lies on, 0 for none.
// In a library of its own (vip_slam_backend_export): PCL's writers load VTK.
#pragma once

#include <cstddef>
#include <string>

#include "vip_slam_backend/map/map.h"

namespace vip_slam {

/// What is left out. Outliers first: the mean of a cube hides them.
struct PointFilter {
  double outliers = 0;  ///< points that are this many standard deviations farther from their neighbours than is usual
                        ///< (pcl::StatisticalOutlierRemoval); 0: none
  double voxel = 0;     ///< one point in each cube of this side, m (pcl::VoxelGrid); 0: all
};

/// ASCII files `stem`.ply and `stem`.pcd with x y z label. How many points they have; no files when there are none.
/// Each file whole or not at all; throws std::runtime_error naming the path, or the cube when it is too small for the
/// map.
std::size_t writePoints(const std::string& stem, const Map& map, const PointFilter& filter = {});

}  // namespace vip_slam
