// SPDX-License-Identifier: BSD-3-Clause
// New planes from the triangles of one keyframe that no known plane explains (paper section "Plane Detection").
#pragma once

#include <vector>

#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/mesh/map_triangles.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

struct DetectedPlane {
  PlaneKind kind = PlaneKind::kGeneral;
  Plane plane;  ///< in `map`, normal towards the camera
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double area = 0;             ///< m^2
  std::vector<int> triangles;  ///< indices
};

/// Histogram peaks, refined on their triangles, split into connected surfaces (gaps above growth.gap separate), tested
/// for fit, width and tilt. `taken[i]` != 0 excludes triangle i.
std::vector<DetectedPlane> detectPlanes(const std::vector<MapTriangle>& triangles, const std::vector<char>& taken,
                                        const Eigen::Vector3d& camera_centre, const PlaneDetectionOptions& options,
                                        const PlaneGrowthOptions& growth);

/// The same tests for free triangles that all lie near one plane already (a peak of votes).
std::vector<DetectedPlane> detectPlanesAt(const std::vector<MapTriangle>& triangles, const std::vector<char>& taken,
                                          PlaneKind kind, const Eigen::Vector3d& camera_centre,
                                          const PlaneDetectionOptions& options, const PlaneGrowthOptions& growth);

}  // namespace vip_slam
