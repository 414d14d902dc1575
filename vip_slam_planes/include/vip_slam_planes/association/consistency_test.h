// SPDX-License-Identifier: BSD-3-Clause
// The paper's geometric-consistency test of a map point against a plane (section "Point and Plane Association"):
// whether its reprojection error stays as small when it is forced onto the plane. Depth is used as well, since with
// little parallax any point can be moved onto a plane behind it without a larger reprojection error.
#pragma once

#include <vector>

#include "vip_slam_core/geometry/plane.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

struct PointSighting {
  SE3 T_C_map;
  Eigen::Vector2d xy;      ///< normalised
  double depth = 0;        ///< metres, 0: none
  double depth_sigma = 0;  ///< metres, systematic part included
  double pixel_sigma = 0;  ///< px; the options' value is used when it is larger
};

struct ConsistencyResult {
  bool solved = false;
  double rms_free = 0, rms_forced = 0, max_forced = 0;  ///< px
  double distance = 0;                                  ///< of the free point to the plane, metres
  double distance_sigma = 0;                            ///< metres
  bool consistent = false;
};

/// `start`: initial estimate of the point in `map`; focal in pixels.
ConsistencyResult testConsistency(const std::vector<PointSighting>& sightings, const Plane& plane,
                                  const Eigen::Vector3d& start, double focal, const PointAssociationOptions& options);

}  // namespace vip_slam
