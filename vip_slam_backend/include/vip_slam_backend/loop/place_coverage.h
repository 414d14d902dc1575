// SPDX-License-Identifier: BSD-3-Clause
// How much of what the map shows of a place an image explains. A door frame that looks like another one explains one
// corner of the image; the true place explains most of it.
#pragma once

#include <vector>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"

namespace vip_slam {

struct PlaceCoverage {
  int features = 0;         ///< features with depth whose point the map's views show as well
  int cells = 0;            ///< cells of the image (an eighth by a sixth) with such features
  int explained_cells = 0;  ///< cells of these with an inlier
};

/// Whether a view shows what lies at `p_V` (its camera's frame, metres): in its image and not behind a nearer surface.
/// `grid`: of the view; empty: nothing hides it.
bool shows(const DepthGrid& grid, const Eigen::Vector3d& p_V, const CameraModel& camera);

/// `features`: of an image taken at T_W_C; `inlier`: one of each; `views`: keyframes of the map, the nearest first.
PlaceCoverage placeCoverage(const Map& map, const std::vector<Feature>& features, const std::vector<bool>& inlier,
                            const SE3& T_W_C, const std::vector<KeyframeId>& views, const CameraModel& camera);

}  // namespace vip_slam
